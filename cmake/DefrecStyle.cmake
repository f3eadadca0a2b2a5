# Rules of style that a tool keeps, as tests: ctest -L style
if(DEFREC_BUILD_TESTS)
  add_test(NAME style/markdown
    COMMAND "${DEFREC_SYSTEM_PYTHON}" "${CMAKE_SOURCE_DIR}/scripts/check_markdown.py"
    "${CMAKE_SOURCE_DIR}")
  set_tests_properties(style/markdown PROPERTIES LABELS style)
endif()
