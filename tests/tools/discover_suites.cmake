# Makes one ctest test of each suite of a gtest program. With a test of each case, as gtest_discover_tests makes them, cases
# could not share what is made once a process: references, prepared scenes.
#
#   cmake -D LABEL=statistical -D "PROPERTIES=COST 1" -D PROGRAM=build/release/tests/statistical_tests
#         -D LIST=build/release/tests/statistical_suites.cmake -P discover_suites.cmake
#
# LIST is for ctest to include. A suite of which cases were skipped is shown as skipped, unless another case failed.
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed COMMAND_ERROR_IS_FATAL ANY)
string(CONCAT skipped "\\[  PASSED  \\] [0-9]+ tests?\\.\n"
                      "\\[  SKIPPED \\] [0-9]+ tests?, listed below:\n(\\[  SKIPPED \\][^\n]*\n)+$")
# Only to end what hangs: far beyond what they take, on a busy machine and under sanitizers too.
set(properties "${PROPERTIES} LABELS ${LABEL} TIMEOUT 2400 SKIP_REGULAR_EXPRESSION [==[${skipped}]==]")
set(tests "")
string(REGEX MATCHALL "(^|\n)[^ \n]+\\.[^\n]*" suites "${listed}")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "^\n|\\.( .*)?$" "" suite "${suite}")
  string(APPEND tests "add_test([=[${LABEL}.${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*]=])\n"
                      "set_tests_properties([=[${LABEL}.${suite}]=] PROPERTIES ${properties})\n")
  # The longest of all, minutes on one core: begun first, others run beside it.
  if(suite STREQUAL "Cells/PathClassTest")
    string(APPEND tests "set_tests_properties([=[${LABEL}.${suite}]=] PROPERTIES COST 3)\n")
  endif()
endforeach()
file(WRITE ${LIST} "${tests}")
