// See plugin_folders.hpp.
#include <dlfcn.h>

#include <cstdlib>

#include "include/defrec_c.h"
#include "sdk/cli/devices/plugin_folders.hpp"
#include "sdk/io/text.hpp"

namespace defrec::cli {

namespace fs = std::filesystem;

std::vector<fs::path> plugin_folders() {
    std::vector<fs::path> folders;
    if (const char* path = ::secure_getenv("DEFREC_PLUGIN_PATH")) {
        for (const std::string_view folder : split(path, ':')) {
            if (!folder.empty() && folder.front() == '/') folders.emplace_back(folder);
        }
    }
    Dl_info info{};
    if (::dladdr(reinterpret_cast<const void*>(&defrec_version), &info) != 0 &&
        info.dli_fname != nullptr) {
        std::error_code error;
        folders.push_back(fs::canonical(info.dli_fname, error).parent_path());
    }
    return folders;
}

}  // namespace defrec::cli
