#include "conformance/report/text.hpp"

#include <cstdint>

namespace defrec::conformance {
namespace {

struct Character {
    uint32_t code = 0;
    size_t length = 0;  // 0: not valid here
};

// RFC 3629: shortest form only, no surrogates, at most U+10FFFF.
Character decode(std::string_view text) {
    const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
    const uint32_t first = byte(0);
    const size_t length = first < 0x80   ? 1
                          : first < 0xC2 ? 0
                          : first < 0xE0 ? 2
                          : first < 0xF0 ? 3
                          : first < 0xF5 ? 4
                                         : 0;
    if (length == 0 || length > text.size()) return {};
    uint32_t code = length == 1 ? first : first & (0x7Fu >> length);
    for (size_t i = 1; i < length; ++i) {
        if ((byte(i) & 0xC0) != 0x80) return {};
        code = code << 6 | (byte(i) & 0x3Fu);
    }
    const bool overlong = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
    if (overlong || (code >= 0xD800 && code < 0xE000) || code > 0x10FFFF) return {};
    return {code, length};
}

// The Char production of XML 1.0.
bool allowed(uint32_t code) {
    return code == 0x9 || code == 0xA || code == 0xD ||
           (code >= 0x20 && code != 0xFFFE && code != 0xFFFF);
}

}  // namespace

std::string valid_text(std::string_view text) {
    std::string out;
    out.reserve(text.size());
    while (!text.empty()) {
        const Character c = decode(text);
        if (c.length > 0 && allowed(c.code))
            out += text.substr(0, c.length);
        else
            out += "\xEF\xBF\xBD";
        text.remove_prefix(c.length > 0 ? c.length : 1);
    }
    return out;
}

RunRecord with_valid_text(RunRecord run) {
    const auto repair = [](auto&... texts) { ((texts = valid_text(texts)), ...); };
    repair(run.suite_version, run.suite_revision, run.started, run.command, run.plugin_name,
           run.plugin_version, run.plugin_vendor, run.plugin_library, run.plugin_sha256,
           run.device_id, run.device_name, run.device_driver, run.system, run.processor);
    for (CaseRecord& c : run.cases) {
        repair(c.id, c.tier, c.stage, c.title, c.reason);
        for (Metric& m : c.metrics) repair(m.name, m.unit);
        for (Picture& p : c.pictures) repair(p.title);
    }
    return run;
}

}  // namespace defrec::conformance
