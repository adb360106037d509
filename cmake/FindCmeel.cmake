# Adds the prefix of the `cmeel-*` wheels (Eigen, Boost) of the current Python to CMAKE_PREFIX_PATH, so that no
# system package is needed. Does nothing where the libraries come from elsewhere.
find_package(Python 3.11 COMPONENTS Interpreter)
if(Python_FOUND)
  execute_process(
    COMMAND "${Python_EXECUTABLE}" -c
      "from importlib.metadata import distribution as d; print(d('cmeel-eigen').locate_file('cmeel.prefix'))"
    OUTPUT_VARIABLE SIDESTEP_CMEEL_PREFIX OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(SIDESTEP_CMEEL_PREFIX)
    keep_files(SIDESTEP_CMEEL_PREFIX include/eigen3 share/eigen3)
    list(APPEND CMAKE_PREFIX_PATH "${SIDESTEP_CMEEL_PREFIX}")
  endif()
endif()
