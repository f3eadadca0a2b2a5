// See library_folder.hpp.
#include <filesystem>

#include "sdk/base/os/windows_api.hpp"
#include "sdk/cli/devices/library_folder.hpp"

namespace defrec::cli {

std::string library_folder() {
    // Where it is loaded from, and not where the program's own stub for it lies.
    HMODULE library = ::GetModuleHandleW(L"libdefrec.dll");
    std::wstring file(32768, L'\0');
    file.resize(::GetModuleFileNameW(library, file.data(), static_cast<DWORD>(file.size())));
    const std::u8string folder = std::filesystem::path(file).parent_path().u8string();
    return {folder.begin(), folder.end()};
}

}  // namespace defrec::cli
