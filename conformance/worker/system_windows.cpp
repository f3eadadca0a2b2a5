// See system.hpp.
#include "conformance/worker/system.hpp"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/os/windows_api.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::conformance {

size_t thread_count() {
    const HANDLE threads = ::CreateToolhelp32Snapshot(TH32CS_SNAPTHREAD, 0);
    THREADENTRY32 thread{};
    thread.dwSize = sizeof thread;
    size_t count = 0;
    for (BOOL more = ::Thread32First(threads, &thread); more;
         more = ::Thread32Next(threads, &thread))
        count += thread.th32OwnerProcessID == ::GetCurrentProcessId();
    ::CloseHandle(threads);
    return count;
}

std::string system_text() {
    // GetVersionEx answers by the program's manifest.
    const auto version = reinterpret_cast<LONG(WINAPI*)(OSVERSIONINFOW*)>(reinterpret_cast<void*>(
        ::GetProcAddress(::GetModuleHandleW(L"ntdll.dll"), "RtlGetVersion")));
    OSVERSIONINFOW info{};
    info.dwOSVersionInfoSize = sizeof info;
    if (version != nullptr) version(&info);
    return concat("Windows ", info.dwMajorVersion, ".", info.dwMinorVersion, ".",
                  info.dwBuildNumber, " x86_64");
}

std::string library_folder() {
    std::wstring file(32768, L'\0');
    const DWORD length = ::GetModuleFileNameW(::GetModuleHandleW(L"libdefrec.dll"), file.data(),
                                              static_cast<DWORD>(file.size()));
    std::string path(3 * size_t{length}, '\0');
    path.resize(size_t(::WideCharToMultiByte(CP_UTF8, 0, file.data(), int(length), path.data(),
                                             int(path.size()), nullptr, nullptr)));
    const size_t name = platform::name_start(path);
    if (name == 0) fail(DEFREC_ERROR_INTERNAL, "the folder of libdefrec is unknown");
    return path.substr(0, name);
}

struct SignalState::State {
    UINT error_mode = ::GetErrorMode();
    DWORD thread_error_mode = ::GetThreadErrorMode();
};

SignalState::SignalState() : state_(std::make_unique<State>()) {}
SignalState::~SignalState() = default;

std::string SignalState::difference(const SignalState& later) const {
    if (state_->error_mode != later.state_->error_mode) return "the process's error mode";
    if (state_->thread_error_mode != later.state_->thread_error_mode)
        return "its caller's error mode";
    return "";
}

}  // namespace defrec::conformance
