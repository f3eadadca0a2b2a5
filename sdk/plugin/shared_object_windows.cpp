// See shared_object.hpp.
#include "sdk/plugin/pe_file.hpp"
#include "sdk/plugin/pe_format.hpp"
#include "sdk/plugin/shared_object.hpp"

namespace defrec {
namespace {

#if defined(__x86_64__) || defined(_M_X64)
constexpr uint16_t kMachine = pe::kMachineAmd64;
#elif defined(__aarch64__) || defined(_M_ARM64)
constexpr uint16_t kMachine = pe::kMachineArm64;
#else
#error "name this machine's PE number here"
#endif

}  // namespace

void check_shared_object(const std::string& path, std::span<const unsigned char> bytes) {
    check_dll(path, bytes, kMachine);
}

}  // namespace defrec
