// See plugin_folders.hpp.
#include <algorithm>
#include <cstdlib>
#include <string>

#include "include/defrec_c.h"
#include "sdk/base/os/windows_api.hpp"
#include "sdk/cli/devices/plugin_folders.hpp"

namespace defrec::cli {

namespace fs = std::filesystem;

std::vector<fs::path> plugin_folders() {
    std::vector<fs::path> folders;
    if (const wchar_t* path = ::_wgetenv(L"DEFREC_PLUGIN_PATH")) {
        const std::wstring list(path);
        for (std::size_t at = 0; at < list.size();) {
            const std::size_t end = std::min(list.find(L';', at), list.size());
            fs::path folder(list.substr(at, end - at));
            if (folder.is_absolute()) folders.push_back(std::move(folder));
            at = end + 1;
        }
    }
    // Where it is loaded from, and not where the program's own stub for it lies.
    HMODULE library = ::GetModuleHandleW(L"libdefrec.dll");
    std::wstring file(32768, L'\0');
    file.resize(::GetModuleFileNameW(library, file.data(), static_cast<DWORD>(file.size())));
    folders.push_back(fs::path(file).parent_path());
    return folders;
}

}  // namespace defrec::cli
