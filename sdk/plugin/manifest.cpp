// See manifest.hpp. yaml-cpp reads the JSON as events, so that no document is built that
// could be deep or large.
#include "sdk/plugin/manifest.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <sstream>

#include "sdk/base/util/error.hpp"

namespace defrec {
namespace {

using Values = std::map<std::string, std::string>;

// Collects the keys and values of one flat object and throws at everything else.
class FlatObject : public YAML::EventHandler {
  public:
    explicit FlatObject(const std::string& path) : path_(path) {}
    const Values& values() const { return values_; }

    void OnDocumentStart(const YAML::Mark&) override {}
    void OnDocumentEnd() override {}
    void OnNull(const YAML::Mark&, YAML::anchor_t) override { refuse("a value is missing"); }
    void OnAlias(const YAML::Mark&, YAML::anchor_t) override { refuse("aliases are not allowed"); }
    void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                         YAML::EmitterStyle::value) override {
        refuse("lists are not allowed");
    }
    void OnSequenceEnd() override {}
    void OnMapStart(const YAML::Mark&, const std::string& tag, YAML::anchor_t anchor,
                    YAML::EmitterStyle::value) override {
        if (inside_) refuse("objects inside an object are not allowed");
        expect_plain(tag, anchor);
        inside_ = true;
    }
    void OnMapEnd() override {}
    void OnScalar(const YAML::Mark&, const std::string& tag, YAML::anchor_t anchor,
                  const std::string& value) override {
        if (!inside_) refuse("not an object");
        expect_plain(tag, anchor);
        if (key_.empty()) {
            if (value.empty()) refuse("a key is empty");
            key_ = value;
            return;
        }
        if (!values_.emplace(key_, value).second) refuse("the key appears twice: ", key_);
        key_.clear();
    }

    template <class... Pieces>
    [[noreturn]] void refuse(const Pieces&... pieces) const {
        fail(DEFREC_ERROR_PLUGIN, path_, ": manifest: ", pieces...);
    }

  private:
    void expect_plain(const std::string& tag, YAML::anchor_t anchor) const {
        if (anchor != YAML::NullAnchor) refuse("anchors are not allowed");
        if (tag != "?" && tag != "!") refuse("tags are not allowed");
    }

    const std::string& path_;
    Values values_;
    std::string key_;
    bool inside_ = false;
};

constexpr std::array kKeys = {"name", "version", "library", "abi_major", "abi_minor", "sha256"};

bool only(const std::string& text, std::string_view allowed) {
    return text.find_first_not_of(allowed) == std::string::npos;
}

uint32_t number(const FlatObject& object, const char* key) {
    const std::string& text = object.values().at(key);
    uint32_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size())
        object.refuse(key, " is \"", text, "\", a number is expected");
    return value;
}

void check_keys(const FlatObject& object) {
    for (const char* key : kKeys)
        if (!object.values().contains(key)) object.refuse("the key ", key, " is missing");
    for (const auto& [key, value] : object.values())
        if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end())
            object.refuse("unknown key ", key);
}

}  // namespace

PluginManifest parse_manifest(const std::string& path, std::span<const unsigned char> bytes) {
    FlatObject object(path);
    if (std::find(bytes.begin(), bytes.end(), '\0') != bytes.end())
        object.refuse("not a text file");
    std::istringstream stream(std::string(bytes.begin(), bytes.end()));
    try {
        YAML::Parser parser(stream);
        if (!parser.HandleNextDocument(object)) object.refuse("empty");
        if (parser.HandleNextDocument(object)) object.refuse("more than one document");
    } catch (const YAML::Exception& error) {
        object.refuse("line ", error.mark.line + 1, ": ", error.msg);
    }
    check_keys(object);
    const Values& values = object.values();

    PluginManifest manifest;
    manifest.name = values.at("name");
    manifest.version = values.at("version");
    manifest.library = values.at("library");
    manifest.sha256 = values.at("sha256");
    manifest.abi_major = number(object, "abi_major");
    manifest.abi_minor = number(object, "abi_minor");
    if (manifest.name.empty() || manifest.name.size() > 32 ||
        !only(manifest.name, "abcdefghijklmnopqrstuvwxyz0123456789_-"))
        object.refuse("name is \"", manifest.name, "\", 1 to 32 of a-z 0-9 _ - expected");
    if (manifest.version.size() > 64) object.refuse("version is longer than 64 characters");
    if (manifest.library.empty() || manifest.library.front() == '.' ||
        manifest.library.find_first_of("/\\") != std::string::npos)
        object.refuse("library is \"", manifest.library,
                      "\", the name of a file beside the manifest expected");
    if (manifest.sha256.size() != 64 || !only(manifest.sha256, "0123456789abcdef"))
        object.refuse("sha256 is \"", manifest.sha256,
                      "\", 64 lower-case hexadecimal digits expected");
    return manifest;
}

}  // namespace defrec
