# Fails unless every line of a release's layout.txt is still in the present one.
# cmake -DRELEASED= -DPRESENT= -P this
cmake_minimum_required(VERSION 3.25)
file(STRINGS "${RELEASED}" released)
file(STRINGS "${PRESENT}" present)
list(REMOVE_ITEM released ${present})
if(released)
  list(JOIN released "\n" gone)
  message(FATAL_ERROR "The ABI changed. Lines of ${RELEASED} are gone or are others now:\n${gone}")
endif()
