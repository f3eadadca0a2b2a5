// See library_folder.hpp.
#include <dlfcn.h>

#include <filesystem>

#include "include/defrec_c.h"
#include "sdk/cli/devices/library_folder.hpp"

namespace defrec::cli {

std::string library_folder() {
    Dl_info info{};
    if (::dladdr(reinterpret_cast<const void*>(&defrec_version), &info) == 0 ||
        info.dli_fname == nullptr)
        return {};
    std::error_code error;
    return std::filesystem::canonical(info.dli_fname, error).parent_path().string();
}

}  // namespace defrec::cli
