# Writes SPIR-V as a C++ array. cmake -DNAME= -DBINARY= -DOUTPUT= -P this
file(READ "${BINARY}" hex HEX)
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${hex}")
string(REGEX REPLACE "(0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,0x[0-9a-f]+,)" "\\1\n" words "${words}")
file(WRITE "${OUTPUT}" "#include \"shaders.hpp\"
namespace defrec::vulkan::shaders {
static constexpr uint32_t kWords[] = {
${words}};
extern const Shader ${NAME}{\"${NAME}\", kWords};
}
")
