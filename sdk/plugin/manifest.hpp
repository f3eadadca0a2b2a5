// A plugin's manifest: what it is, checked before its library is opened.
#pragma once
#include <cstdint>
#include <span>
#include <string>

namespace defrec {

struct PluginManifest {
    std::string name;     // [a-z0-9_-], at most 32
    std::string version;  // for people
    std::string library;  // a file name beside the manifest
    uint32_t abi_major = 0, abi_minor = 0;
    std::string sha256;  // of the library, 64 lower-case hexadecimal digits
};

inline constexpr uint64_t kManifestCap = 65536;  // bytes

// Strict: one flat object with exactly these keys, once each; no anchors, aliases or tags. Throws
// Error(DEFREC_ERROR_PLUGIN) whose text names path and key.
PluginManifest parse_manifest(const std::string& path, std::span<const unsigned char> bytes);

}  // namespace defrec
