# cmake -DSOURCE=FOLDER -DOUTPUT=FILE.h -P commit.cmake: writes which commit is built, as "unknown" where that cannot be found out. The file
# is only touched where it changes.
set(commit "unknown")
execute_process(COMMAND git -C ${SOURCE} rev-parse --show-prefix --short=12 HEAD
                OUTPUT_VARIABLE said ERROR_QUIET RESULT_VARIABLE failed)
if(NOT failed AND said MATCHES "^\n([0-9a-f]+)\n$") # no prefix: the repository is ours, not one around it
  set(commit ${CMAKE_MATCH_1})
  execute_process(COMMAND git -C ${SOURCE} diff --quiet HEAD RESULT_VARIABLE changed ERROR_QUIET)
  if(changed)
    string(APPEND commit " with changes")
  endif()
endif()
set(text "#define DPH_COMMIT \"${commit}\"\n")
set(had "")
if(EXISTS ${OUTPUT})
  file(READ ${OUTPUT} had)
endif()
if(NOT had STREQUAL text)
  file(WRITE ${OUTPUT} "${text}")
endif()
