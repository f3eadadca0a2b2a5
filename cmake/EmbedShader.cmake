# Writes SPIR-V as a C++ array. cmake -DNAME= -DBINARY= -DOUTPUT= -P this
include("${CMAKE_CURRENT_LIST_DIR}/WordsOfFile.cmake")
defrec_words_of("${BINARY}" words)
file(WRITE "${OUTPUT}"
     "#include \"shaders.hpp\"
namespace defrec::vulkan::shaders {
static constexpr uint32_t kWords[] = {
${words}};
extern const Shader ${NAME}{\"${NAME}\", kWords};
}
")
