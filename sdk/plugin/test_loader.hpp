// For the tests of the loader: plugins that it refuses.
#pragma once
#include <doctest/doctest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"

namespace defrec::test {

inline std::string library_name(const std::string& plugin) {
    return "defrec_plugin_" + plugin + DEFREC_PLUGIN_SUFFIX;
}
inline const std::string kLibrary = library_name("good");
constexpr char kManifest[] = "defrec_plugin_good.json";

// The one candidate found in a folder is refused, with this status and these words, beside a good
// plugin that is loaded.
inline void check_refused(const std::filesystem::path& folder, defrec_status verdict,
                          const std::vector<std::string>& words) {
    const TestContext context({folder.string(), stub_folder("twin").string()});
    REQUIRE(defrec_plugin_count(context.get()) == 2);
    const defrec_plugin_info info = context.plugin(0);
    INFO(info.reason);
    CHECK(info.verdict == verdict);
    CHECK(contains(info.reason, folder.filename().string()));
    for (const std::string& word : words) CHECK(contains(info.reason, word));
    CHECK(context.plugin(1).verdict == DEFREC_OK);
    CHECK(defrec_device_count(context.get()) == 1);
}

// A copy of the plugin "good" whose library, and by default the manifest with it, was changed.
template <class Change>
void check_changed(Change change, bool adapt_manifest, defrec_status verdict,
                   const std::vector<std::string>& words) {
    const TemporaryFolder folder;
    const auto original = read_file(stub_folder("good") / kLibrary);
    auto bytes = original;
    change(bytes);
    write_file(folder.path() / kLibrary, bytes);
    write_file(folder.path() / kManifest,
               manifest_text(kLibrary, adapt_manifest ? bytes : original));
    check_refused(folder.path(), verdict, words);
}

}  // namespace defrec::test
