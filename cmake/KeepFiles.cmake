# keep_files(<variable> <folder>...): copies folders of a wheel, given relative to the folder that <variable> names, into the
# build folder, and lets <variable> name the copy. A build in an isolated environment finds its requirements in another
# place every time; from the same place, and left alone where they are the same, nothing is compiled again.
function(keep_files variable)
  if(NOT SKBUILD)
    return()
  endif()
  set(kept "${CMAKE_BINARY_DIR}/requirements/${variable}")
  foreach(folder ${ARGN})
    execute_process(COMMAND "${CMAKE_COMMAND}" -E copy_directory_if_different "${${variable}}/${folder}" "${kept}/${folder}"
      COMMAND_ERROR_IS_FATAL ANY)
  endforeach()
  set(${variable} "${kept}" PARENT_SCOPE)
endfunction()
