// See child_program.hpp.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "sdk/base/os/windows_api.hpp"
#include "sdk/cli/devices/child_program.hpp"
#include "sdk/io/exit_code.hpp"

namespace defrec::cli {
namespace {

struct CloseHandleOf {
    using pointer = HANDLE;
    void operator()(HANDLE handle) const { ::CloseHandle(handle); }
};
using OwnedHandle = std::unique_ptr<void, CloseHandleOf>;

// As CommandLineToArgvW takes it apart: a backslash is one, but before a quotation mark.
std::wstring quoted(const std::wstring& argument) {
    std::wstring result = L"\"";
    std::size_t backslashes = 0;
    for (const wchar_t c : argument) {
        if (c == L'"') result.append(backslashes + 1, L'\\');
        backslashes = c == L'\\' ? backslashes + 1 : 0;
        result += c;
    }
    result.append(backslashes, L'\\');
    return result + L'"';
}

std::wstring command_of(const std::vector<std::string>& arguments) {
    std::wstring command;
    for (const std::string& argument : arguments)
        command +=
            (command.empty() ? L"" : L" ") +
            quoted(
                std::filesystem::path(std::u8string(argument.begin(), argument.end())).wstring());
    return command;
}

OwnedHandle nothing() {
    SECURITY_ATTRIBUTES inherited{sizeof inherited, nullptr, TRUE};
    return OwnedHandle(::CreateFileW(L"NUL", GENERIC_READ | GENERIC_WRITE,
                                     FILE_SHARE_READ | FILE_SHARE_WRITE, &inherited, OPEN_EXISTING,
                                     0, nullptr));
}

// What lies in the pipe now.
void take(HANDLE pipe, std::string& text) {
    constexpr std::size_t kMaxRead = 1 << 20;
    for (DWORD waiting = 0;
         ::PeekNamedPipe(pipe, nullptr, 0, nullptr, &waiting, nullptr) != 0 && waiting > 0;) {
        char buffer[4096];
        DWORD got = 0;
        if (::ReadFile(pipe, buffer, std::min<DWORD>(waiting, sizeof buffer), &got, nullptr) == 0)
            return;
        text.append(buffer, std::min<std::size_t>(got, kMaxRead - text.size()));
    }
}

}  // namespace

ChildOutput run_child(const std::vector<std::string>& arguments, std::chrono::milliseconds limit) {
    SECURITY_ATTRIBUTES inherited{sizeof inherited, nullptr, TRUE};
    HANDLE ends[2];
    if (::CreatePipe(&ends[0], &ends[1], &inherited, 0) == 0)
        throw CliError(ExitCode::kInternal, "no pipe can be opened.");
    const OwnedHandle read_end(ends[0]);
    OwnedHandle write_end(ends[1]);
    ::SetHandleInformation(read_end.get(), HANDLE_FLAG_INHERIT, 0);
    const OwnedHandle null = nothing();

    STARTUPINFOW start{};
    start.cb = sizeof start;
    start.dwFlags = STARTF_USESTDHANDLES;
    start.hStdInput = start.hStdError = null.get();
    start.hStdOutput = write_end.get();
    PROCESS_INFORMATION process{};
    std::wstring command = command_of(arguments);
    if (::CreateProcessW(nullptr, command.data(), nullptr, nullptr, TRUE, CREATE_NO_WINDOW, nullptr,
                         nullptr, &start, &process) == 0)
        throw CliError(ExitCode::kInternal,
                       arguments[0] + ": cannot be started again for the probe.");
    const OwnedHandle child(process.hProcess), thread(process.hThread);
    write_end.reset();

    ChildOutput output;
    const auto deadline = std::chrono::steady_clock::now() + limit;
    while (::WaitForSingleObject(child.get(), 5) == WAIT_TIMEOUT) {
        take(read_end.get(), output.text);
        if (std::chrono::steady_clock::now() < deadline) continue;
        output.timed_out = true;
        ::TerminateProcess(child.get(), 1);
        ::WaitForSingleObject(child.get(), INFINITE);
        return output;
    }
    take(read_end.get(), output.text);
    DWORD code = 0;
    ::GetExitCodeProcess(child.get(), &code);
    // An exception that nobody handled is the exit code: NTSTATUS, errors from 0xC0000000 on.
    if (code >= 0xC0000000u) {
        char text[32];
        std::snprintf(text, sizeof text, "exception 0x%08lx", static_cast<unsigned long>(code));
        output.crash = text;
    }
    output.exit_code = static_cast<int>(code);
    return output;
}

}  // namespace defrec::cli
