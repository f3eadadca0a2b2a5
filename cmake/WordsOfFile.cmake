# defrec_words_of(BINARY VARIABLE)
# A file as little-endian 32-bit words, for the initialiser of a C++ array.
function(defrec_words_of binary variable)
  file(READ "${binary}" hex HEX)
  string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${hex}")
  string(
    REGEX
    REPLACE
      "(0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,)"
      "\\1\n"
      words
      "${words}")
  set(${variable} "${words}" PARENT_SCOPE)
endfunction()
