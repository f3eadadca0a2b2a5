// A plugin's manifest.
#include "sdk/base/util/error.hpp"
#include "sdk/plugin/manifest.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    try {
        const defrec::PluginManifest manifest = defrec::parse_manifest("manifest", {data, size});
        if (manifest.name.empty() || manifest.name.size() > 32 || manifest.sha256.size() != 64)
            __builtin_trap();
    } catch (const defrec::Error&) {
    }
    return 0;
}
