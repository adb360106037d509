# Counts the instructions of one step of each kind with callgrind and compares them with instructions.txt, lines of
# `kind count`. Fails where a count has grown by more than 10 %. With -D RECORD=ON it writes the file instead.
#   cmake -D VALGRIND=valgrind -D PROGRAM=build/benchmarks/cpp/instructions_benchmark -P instructions.cmake
#
# The difference of two runs is that of the steps alone. Compilers differ by a few per cent; valgrind shows programs a
# processor without AVX-512, so that the counts do not depend on the machine.
cmake_minimum_required(VERSION 3.26)
set(file "${CMAKE_CURRENT_LIST_DIR}/instructions.txt")
set(steps 100)

function(count_instructions kind num result)
  execute_process(COMMAND "${VALGRIND}" --tool=callgrind --callgrind-out-file=/dev/null "${PROGRAM}" ${kind} ${num}
    ERROR_VARIABLE log RESULT_VARIABLE status)
  if(NOT status EQUAL 0 OR NOT log MATCHES "Collected : ([0-9]+)")
    message(FATAL_ERROR "callgrind on ${PROGRAM} ${kind} ${num} failed (${status}):\n${log}")
  endif()
  set(${result} ${CMAKE_MATCH_1} PARENT_SCOPE)
endfunction()

set(counts "")
set(failed FALSE)
foreach(kind density barriers filtered cloud)
  count_instructions(${kind} ${steps} once)
  math(EXPR twice_steps "2 * ${steps}")
  count_instructions(${kind} ${twice_steps} twice)
  math(EXPR count "(${twice} - ${once}) / ${steps}")
  string(APPEND counts "${kind} ${count}\n")
  if(RECORD)
    continue()
  endif()
  file(STRINGS "${file}" line REGEX "^${kind} [0-9]+$")
  if(NOT line MATCHES " ([0-9]+)$")
    message(FATAL_ERROR "${file} has no line for '${kind}'")
  endif()
  set(recorded ${CMAKE_MATCH_1})
  math(EXPR most "${recorded} * 110 / 100")
  message(STATUS "${kind}: ${count} instructions per step, recorded ${recorded}")
  if(count GREATER most)
    message(SEND_ERROR "${kind}: ${count} instructions per step, more than 10 % above the ${recorded} recorded; if that is "
      "wanted, run with -D RECORD=ON")
  endif()
endforeach()
if(RECORD)
  file(WRITE "${file}" "${counts}")
  message(STATUS "${counts}")
endif()
