# Writes a recorded body of `defrec render` as a C++ array. cmake -DNAME= -DBINARY= -DOUTPUT= -P
# this
include("${CMAKE_CURRENT_LIST_DIR}/WordsOfFile.cmake")
defrec_words_of("${BINARY}" words)
file(WRITE "${OUTPUT}"
     "#include \"sdk/scenes/bodies/recorded_body.hpp\"
namespace defrec::cli::recorded {
static constexpr std::uint32_t kWords[] = {
${words}};
const RecordedWords ${NAME}{kWords};
}
")
