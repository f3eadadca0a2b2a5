# Rules of style that a tool keeps, as tests: ctest -L style. Once is enough: not in builds for
# other machines.
if(DEFREC_BUILD_TESTS AND NOT CMAKE_CROSSCOMPILING)
  add_test(NAME style/markdown
           COMMAND "${DEFREC_SYSTEM_PYTHON}" "${CMAKE_SOURCE_DIR}/scripts/check_markdown.py"
                   "${CMAKE_SOURCE_DIR}")
  # Exit status 77: a tool is missing.
  add_test(NAME style/format COMMAND "${CMAKE_SOURCE_DIR}/scripts/format.sh" --check)
  add_test(NAME style/lines
           COMMAND "${DEFREC_SYSTEM_PYTHON}" -B "${CMAKE_SOURCE_DIR}/scripts/check_line_length.py"
                   "${CMAKE_SOURCE_DIR}")
  add_test(NAME style/format_check COMMAND "${DEFREC_SYSTEM_PYTHON}" -B
                                           "${CMAKE_SOURCE_DIR}/scripts/test_format.py")
  add_test(NAME style/lines_check COMMAND "${DEFREC_SYSTEM_PYTHON}" -B
                                          "${CMAKE_SOURCE_DIR}/scripts/test_check_line_length.py")
  set(layers "${CMAKE_SOURCE_DIR}/scripts/layers")
  add_test(NAME style/layers COMMAND "${DEFREC_SYSTEM_PYTHON}" -B "${layers}/check.py")
  add_test(NAME style/layers_check COMMAND "${DEFREC_SYSTEM_PYTHON}" -B "${layers}/test_check.py")
  add_test(NAME style/comments COMMAND "${DEFREC_SYSTEM_PYTHON}" -B
                                       "${CMAKE_SOURCE_DIR}/scripts/check_comments.py")
  add_test(NAME style/comments_check COMMAND "${DEFREC_SYSTEM_PYTHON}" -B
                                             "${CMAKE_SOURCE_DIR}/scripts/test_check_comments.py")
  set(decisions "${CMAKE_SOURCE_DIR}/scripts/decisions")
  add_test(NAME style/decisions COMMAND "${DEFREC_SYSTEM_PYTHON}" -B "${decisions}/check.py")
  add_test(NAME style/decisions_check COMMAND "${DEFREC_SYSTEM_PYTHON}" -B
                                              "${decisions}/test_decisions.py")
  set(styles
      style/markdown style/format style/format_check style/lines_check style/lines style/layers
      style/layers_check style/comments style/comments_check style/decisions style/decisions_check)
  # It checks what is compiled, so once is enough: not in builds with sanitizers.
  if(NOT DEFREC_SANITIZE)
    add_test(NAME style/tidy
             COMMAND "${DEFREC_SYSTEM_PYTHON}" "${CMAKE_SOURCE_DIR}/scripts/tidy.py" --build
                     "${CMAKE_BINARY_DIR}")
    set_tests_properties(style/tidy PROPERTIES COST ${DEFREC_COST_FIRST} TIMEOUT 3600)
    list(APPEND styles style/tidy)
  endif()
  set_tests_properties(${styles} PROPERTIES LABELS style SKIP_RETURN_CODE 77)
  defrec_mark_slow(style/format)
  if(NOT DEFREC_SANITIZE)
    defrec_mark_slow(style/tidy)
  endif()
endif()
