# Writes the revision of TREE, and whether it has changes of its own, into HEADER. cmake -DTREE=
# -DHEADER= -P this
set(revision "unknown")
set(dirty false)
execute_process(COMMAND git -C "${TREE}" rev-parse --show-toplevel OUTPUT_VARIABLE top
                OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed ERROR_QUIET)
# A copy of the sources inside another project's repository has that project's revision, which says
# nothing.
file(REAL_PATH "${TREE}" tree)
if(NOT failed AND top STREQUAL tree)
  execute_process(COMMAND git -C "${TREE}" rev-parse HEAD OUTPUT_VARIABLE head
                  OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed ERROR_QUIET)
  execute_process(COMMAND git -C "${TREE}" status --porcelain OUTPUT_VARIABLE changes
                  RESULT_VARIABLE status_failed ERROR_QUIET)
  if(NOT failed AND NOT status_failed)
    set(revision "${head}")
    if(NOT changes STREQUAL "")
      set(dirty true)
    endif()
  endif()
endif()
set(text
    "#pragma once
#define DEFREC_SUITE_REVISION \"${revision}\"
#define DEFREC_SUITE_DIRTY ${dirty}
")
set(old "")
if(EXISTS "${HEADER}")
  file(READ "${HEADER}" old)
endif()
if(NOT text STREQUAL old)
  file(WRITE "${HEADER}" "${text}")
endif()
