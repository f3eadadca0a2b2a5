// See search.hpp.
#include "sdk/plugin/search.hpp"

#include <algorithm>
#include <set>
#include <string_view>

#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec {
namespace {

bool is_manifest_name(std::string_view name) {
    return name.starts_with("defrec_plugin_") && name.ends_with(".json");
}

class PluginSearch {
  public:
    explicit PluginSearch(const FolderRefusal& refusal_of) : refusal_of_(refusal_of) {}

    // Reports why nothing is found there; a missing path only if asked.
    void look_in(const std::string& path, bool report_missing) {
        if (!platform::is_absolute(path)) {
            return refuse(DEFREC_ERROR_ARGUMENT, path,
                          "not an absolute path, so it is not searched");
        }
        switch (platform::path_kind(path)) {
            case platform::PathKind::kFolder:
                return look_in_folder(path);
            case platform::PathKind::kFile:
                return add(path);
            case platform::PathKind::kOther:
                return refuse(DEFREC_ERROR_PLUGIN, path, "neither a folder nor a regular file");
            case platform::PathKind::kMissing:
                if (report_missing) refuse(DEFREC_ERROR_IO, path, "no such file or folder");
        }
    }

    std::vector<FoundManifest> take() { return std::move(found_); }

  private:
    void look_in_folder(const std::string& folder) {
        const std::string reason = refusal_of_(folder);
        if (!reason.empty()) return refuse_with(DEFREC_ERROR_PLUGIN, folder, reason);
        std::vector<std::string> names;
        try {
            names = platform::list_folder(folder);
        } catch (const Error& error) {
            return refuse_with(error.status(), folder, error.what());
        }
        const bool is_closed = platform::name_start(folder) == folder.size();
        for (const std::string& name : names)
            if (is_manifest_name(name)) add(folder + (is_closed ? "" : "/") + name);
    }

    void add(const std::string& path) {
        const std::string real = platform::canonical_path(path);
        if (seen_.insert(real.empty() ? path : real).second)
            found_.push_back({path, "", DEFREC_OK});
    }

    void refuse(defrec_status verdict, const std::string& path, const char* reason) {
        refuse_with(verdict, path, concat(path, ": ", reason));
    }
    void refuse_with(defrec_status verdict, const std::string& path, const std::string& text) {
        found_.push_back({path, text, verdict});
    }

    const FolderRefusal& refusal_of_;
    std::set<std::string> seen_;
    std::vector<FoundManifest> found_;
};

}  // namespace

std::vector<FoundManifest> find_manifests(const PluginPlaces& places,
                                          const FolderRefusal& refusal_of) {
    PluginSearch search(refusal_of);
    for (const std::string& place : places.given) search.look_in(place, true);
    if (places.use_environment) {
        const std::string paths = platform::trusted_environment("DEFREC_PLUGIN_PATH").value_or("");
        for (size_t at = 0; at < paths.size();) {
            const size_t end = std::min(paths.find(platform::list_separator(), at), paths.size());
            if (end > at) search.look_in(paths.substr(at, end - at), true);
            at = end + 1;
        }
    }
    if (!places.library_folder.empty()) search.look_in(places.library_folder, false);
    return search.take();
}

}  // namespace defrec
