// What the process that opens a plugin prints: it is refused, or means the same once written anew.
#include "sdk/cli/devices/probe_reply.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace defrec::cli;
    const auto reply = read_probe_reply({reinterpret_cast<const char*>(data), size});
    if (reply && read_probe_reply(write_probe_reply(*reply)) != reply) __builtin_trap();
    return 0;
}
