# Compares the ABI of LIBRARY (its symbols read by NM, its soname by READELF, its structs printed by
# PROGRAM) with the one recorded in RECORD, and its functions with those declared in HEADER.
function(run variable)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  set(${variable} "${text}" PARENT_SCOPE)
endfunction()

run(symbols ${NM} -D --defined-only ${LIBRARY})
string(REGEX MATCHALL "[^ \n]+\n" exported "${symbols}")
list(TRANSFORM exported STRIP)
list(SORT exported)
file(READ ${HEADER} text)
string(REGEX MATCHALL "solidtex_[a-z0-9_]+\\(" declared "${text}")
list(TRANSFORM declared REPLACE "\\($" "")
list(REMOVE_DUPLICATES declared)
list(SORT declared)
if(NOT declared STREQUAL exported)
  message(FATAL_ERROR "declared: ${declared}\nexported: ${exported}")
endif()

run(dynamic ${READELF} -d ${LIBRARY})
string(REGEX MATCH "soname: \\[([^]]*)" soname "${dynamic}")
run(layout ${PROGRAM})
list(TRANSFORM exported PREPEND "function ")
list(JOIN exported "\n" functions)
set(found "soname ${CMAKE_MATCH_1}\n${functions}\n${layout}")
file(READ ${RECORD} recorded)
string(REGEX REPLACE "#[^\n]*\n" "" recorded "${recorded}")
if(NOT found STREQUAL recorded)
  message(FATAL_ERROR "The ABI is not the one in ${RECORD}. Hosts that were compiled before go on "
                      "working where lines were only added; else the soname changes with it. "
                      "It is now:\n${found}")
endif()
