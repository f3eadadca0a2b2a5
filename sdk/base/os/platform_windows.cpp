// platform.hpp on Windows. Paths are UTF-8 above, UTF-16 here; both separators are understood.
#include <fcntl.h>
#include <io.h>

#include <algorithm>
#include <cfenv>
#include <cstring>
#include <filesystem>
#include <memory>
#include <mutex>
#include <system_error>
#if defined(__x86_64__) || defined(_M_X64)
#include <immintrin.h>
#endif

#include "sdk/base/os/descriptor.hpp"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/os/windows_api.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::platform {
namespace {

// Throws Error(DEFREC_ERROR_IO) for what is not UTF-8.
std::wstring wide(std::string_view text) {
    if (text.empty()) return {};
    const int length = static_cast<int>(text.size());
    const int size =
        MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text.data(), length, nullptr, 0);
    if (size == 0) fail(DEFREC_ERROR_IO, "a path is not UTF-8");
    std::wstring result(static_cast<size_t>(size), L'\0');
    MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text.data(), length, result.data(), size);
    return result;
}

std::string narrow(std::wstring_view text) {
    if (text.empty()) return {};
    const int length = static_cast<int>(text.size());
    const int size =
        WideCharToMultiByte(CP_UTF8, 0, text.data(), length, nullptr, 0, nullptr, nullptr);
    std::string result(static_cast<size_t>(size), '\0');
    WideCharToMultiByte(CP_UTF8, 0, text.data(), length, result.data(), size, nullptr, nullptr);
    return result;
}

std::string system_message(DWORD error) {
    return std::system_category().message(static_cast<int>(error));
}

struct CloseHandleOf {
    using pointer = HANDLE;
    void operator()(HANDLE handle) const { CloseHandle(handle); }
};
using OwnedHandle = std::unique_ptr<void, CloseHandleOf>;

// What a handle refers to, without links and dots; empty where the system does not say.
std::wstring final_path(HANDLE handle) {
    const DWORD size = GetFinalPathNameByHandleW(handle, nullptr, 0, FILE_NAME_NORMALIZED);
    std::wstring path(size, L'\0');
    const DWORD length = GetFinalPathNameByHandleW(handle, path.data(), size, FILE_NAME_NORMALIZED);
    if (length == 0 || length >= size) return {};
    path.resize(length);
    constexpr std::wstring_view kLong = L"\\\\?\\", kLongShare = L"\\\\?\\UNC\\";
    if (path.starts_with(kLongShare)) return L"\\\\" + path.substr(kLongShare.size());
    if (path.starts_with(kLong)) path.erase(0, kLong.size());
    return path;
}

HMODULE own_module() {
    HMODULE module = nullptr;
    GetModuleHandleExW(
        GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
        reinterpret_cast<LPCWSTR>(&own_folder), &module);
    return module;
}

// Its threads, and those of plugins, may be under way: once used it stays.
void keep_loaded() {
    static const bool kept = [] {
        HMODULE module = nullptr;
        return GetModuleHandleExW(
                   GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_PIN,
                   reinterpret_cast<LPCWSTR>(&own_folder), &module) != 0;
    }();
    (void)kept;
}

// x87, and the unit that computes float and double, which not every runtime's fenv_t has.
struct FloatingPoint {
    std::fenv_t environment;
    uint32_t vectors;

    void read() {
        std::fegetenv(&environment);
#if defined(__x86_64__) || defined(_M_X64)
        vectors = _mm_getcsr();
#endif
    }
    void set() const {
        std::fesetenv(&environment);
#if defined(__x86_64__) || defined(_M_X64)
        _mm_setcsr(vectors);
#endif
    }
    static void set_default() {
        std::fesetenv(FE_DFL_ENV);
#if defined(__x86_64__) || defined(_M_X64)
        _mm_setcsr(0x1f80);  // all exceptions masked, rounding to nearest, denormals kept
#endif
    }
};

}  // namespace

// There is no fork.
uint64_t process_id() noexcept { return GetCurrentProcessId(); }

// There are no signals that a thread could receive. A priority is not taken over by itself, as it
// is on Linux.
std::thread start_thread(std::function<void()> body) {
    keep_loaded();
    const int priority = GetThreadPriority(GetCurrentThread());
    try {
        return std::thread([run = std::move(body), priority] {
            if (priority != THREAD_PRIORITY_ERROR_RETURN)
                (void)SetThreadPriority(GetCurrentThread(), priority);
            FloatingPoint::set_default();
            run();
        });
    } catch (const std::system_error& error) {
        fail(DEFREC_ERROR_OUT_OF_MEMORY, "cannot start a thread: ", error.what());
    }
}

void lower_priority() noexcept {
    (void)SetThreadPriority(GetCurrentThread(), THREAD_PRIORITY_BELOW_NORMAL);
}

DefaultFloatingPoint::DefaultFloatingPoint() noexcept {
    static_assert(sizeof(FloatingPoint) <= sizeof saved_ && alignof(FloatingPoint) <= 16);
    reinterpret_cast<FloatingPoint*>(saved_)->read();
    FloatingPoint::set_default();
}
DefaultFloatingPoint::~DefaultFloatingPoint() {
    reinterpret_cast<const FloatingPoint*>(saved_)->set();
}

// Threads are not cancelled there.
NoCancellation::NoCancellation() noexcept : before_(0) {}
NoCancellation::~NoCancellation() { (void)before_; }

void without_file_size_signal(const std::function<void()>& body) { body(); }

void spin_pause() noexcept { YieldProcessor(); }

// A tick of the clock that wakes threads, where no process asks for shorter ones.
std::chrono::microseconds sleep_error() noexcept { return std::chrono::milliseconds(16); }

size_t name_start(std::string_view path) noexcept { return path.find_last_of("/\\") + 1; }

char list_separator() noexcept { return ';'; }

PathKind path_kind(const std::string& path) noexcept {
    try {
        std::error_code ignored;
        switch (std::filesystem::status(wide(path), ignored).type()) {
            case std::filesystem::file_type::not_found:
            case std::filesystem::file_type::none:
                return PathKind::kMissing;
            case std::filesystem::file_type::regular:
                return PathKind::kFile;
            case std::filesystem::file_type::directory:
                return PathKind::kFolder;
            default:
                return PathKind::kOther;
        }
    } catch (...) {
        return PathKind::kMissing;
    }
}

namespace {

// Groups that everybody who can log in belongs to, and visitors.
constexpr struct {
    WELL_KNOWN_SID_TYPE type;
    const char* name;
} kEverybody[] = {
    {WinWorldSid, "anybody"},
    {WinAnonymousSid, "anonymous users"},
    {WinAuthenticatedUserSid, "every user who logs in"},
    {WinInteractiveSid, "every user at this machine"},
    {WinNetworkSid, "every user over the network"},
    {WinBuiltinUsersSid, "every user of the group Users"},
    {WinBuiltinGuestsSid, "every guest"},
};

const char* everybody_name(PSID account) {
    for (const auto& group : kEverybody)
        if (IsWellKnownSid(account, group.type)) return group.name;
    return nullptr;
}

// Empty where nobody of kEverybody has one of these rights.
std::string who_has(const std::string& path, DWORD rights) {
    PACL list = nullptr;
    PSECURITY_DESCRIPTOR security = nullptr;
    const DWORD error =
        GetNamedSecurityInfoW(wide(path).data(), SE_FILE_OBJECT, DACL_SECURITY_INFORMATION, nullptr,
                              nullptr, &list, nullptr, &security);
    if (error == ERROR_FILE_NOT_FOUND || error == ERROR_PATH_NOT_FOUND) return {};
    if (error != ERROR_SUCCESS)
        return concat("who may write cannot be read (", system_message(error), "), so anybody may");
    const std::unique_ptr<void, decltype(&LocalFree)> owner(security, LocalFree);
    if (list == nullptr) return "anybody may write";
    GENERIC_MAPPING generic{FILE_GENERIC_READ, FILE_GENERIC_WRITE, FILE_GENERIC_EXECUTE,
                            FILE_ALL_ACCESS};
    for (DWORD i = 0; i < list->AceCount; ++i) {
        void* entry = nullptr;
        if (GetAce(list, i, &entry) == 0) continue;
        const auto* header = static_cast<const ACE_HEADER*>(entry);
        if (header->AceType != ACCESS_ALLOWED_ACE_TYPE || (header->AceFlags & INHERIT_ONLY_ACE))
            continue;
        auto* allowed = static_cast<ACCESS_ALLOWED_ACE*>(entry);
        DWORD mask = allowed->Mask;
        MapGenericMask(&mask, &generic);
        const char* name = everybody_name(&allowed->SidStart);
        if (name != nullptr && (mask & rights) != 0) return concat(name, " may write");
    }
    return {};
}

constexpr DWORD kReplace = DELETE | WRITE_DAC | WRITE_OWNER;

std::string with_slashes(std::string path) {
    std::replace(path.begin(), path.end(), '\\', '/');
    return path;
}

}  // namespace

std::string who_may_change(const std::string& path) {
    const std::string real = with_slashes(canonical_path(path)), own = with_slashes(own_folder());
    if (real.empty()) return {};
    const bool is_folder = path_kind(path) == PathKind::kFolder;
    // What lies beside this library may be changed by whoever may change the library.
    if (is_folder ? real + "/" == own : real.substr(0, real.find_last_of('/') + 1) == own)
        return {};
    const std::string who = who_has(
        real, is_folder ? kReplace | FILE_ADD_FILE | FILE_ADD_SUBDIRECTORY | FILE_DELETE_CHILD
                        : kReplace | FILE_WRITE_DATA | FILE_APPEND_DATA);
    if (!who.empty())
        return concat(path, ": ", who, is_folder ? " to this folder" : " to this file");
    std::string above = real;
    for (size_t end = above.find_last_of('/'); end != std::string::npos;
         end = above.find_last_of('/')) {
        above.resize(end);
        if (own.starts_with(above + "/")) continue;
        const std::string other = who_has(above + "/", kReplace | FILE_DELETE_CHILD);
        if (!other.empty()) return concat(above, "/: ", other, " to this folder");
    }
    return {};
}

// With a drive, or a share; "\\x" and "C:x" depend on the working folder.
bool is_absolute(std::string_view path) noexcept {
    const auto is_separator = [](char c) { return c == '/' || c == '\\'; };
    if (path.size() >= 3 && path[1] == ':' && is_separator(path[2])) return true;
    return path.size() >= 3 && is_separator(path[0]) && is_separator(path[1]);
}

std::string canonical_path(const std::string& path) {
    try {
        const HANDLE handle = CreateFileW(
            wide(path).c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, nullptr,
            OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);
        if (handle == INVALID_HANDLE_VALUE) return {};
        const OwnedHandle owner(handle);
        return narrow(final_path(handle));
    } catch (const Error&) {
        return {};
    }
}

std::vector<std::string> list_folder(const std::string& path) {
    std::vector<std::string> names;
    std::error_code error;
    for (std::filesystem::directory_iterator entry(wide(path), error), end; !error && entry != end;
         entry.increment(error))
        names.push_back(narrow(entry->path().filename().native()));
    if (error) fail(DEFREC_ERROR_IO, path, ": ", error.message());
    std::sort(names.begin(), names.end());
    return names;
}

// While it is open nobody can write to it, or give its name to another: open_library() relies on
// it.
OpenedFile read_regular_file(const std::string& path, uint64_t cap) {
    if (path_kind(path) == PathKind::kFolder)
        fail(DEFREC_ERROR_PLUGIN, path, ": not a regular file");
    const HANDLE handle = CreateFileW(wide(path).c_str(), GENERIC_READ, FILE_SHARE_READ, nullptr,
                                      OPEN_EXISTING, FILE_ATTRIBUTE_NORMAL, nullptr);
    if (handle == INVALID_HANDLE_VALUE)
        fail(DEFREC_ERROR_IO, path, ": ", system_message(GetLastError()));
    OwnedHandle owner(handle);
    LARGE_INTEGER size;
    if (GetFileType(handle) != FILE_TYPE_DISK)
        fail(DEFREC_ERROR_PLUGIN, path, ": not a regular file");
    if (GetFileSizeEx(handle, &size) == 0)
        fail(DEFREC_ERROR_IO, path, ": ", system_message(GetLastError()));
    const auto count = static_cast<uint64_t>(size.QuadPart);
    if (count > cap)
        fail(DEFREC_ERROR_PLUGIN, path, ": ", count, " bytes, at most ", cap, " are read");
    std::vector<unsigned char> bytes(count);
    uint64_t have = 0;
    while (have < count) {
        const DWORD part = static_cast<DWORD>(std::min<uint64_t>(count - have, 1u << 30));
        DWORD got = 0;
        if (ReadFile(handle, bytes.data() + have, part, &got, nullptr) == 0)
            fail(DEFREC_ERROR_IO, path, ": ", system_message(GetLastError()));
        if (got == 0) break;
        have += got;
    }
    bytes.resize(have);
    Descriptor descriptor{
        _open_osfhandle(reinterpret_cast<intptr_t>(handle), _O_RDONLY | _O_BINARY | _O_NOINHERIT)};
    if (!descriptor) fail(DEFREC_ERROR_IO, path, ": too many files are open");
    (void)owner.release();  // the descriptor's now
    return {std::move(descriptor), std::move(bytes)};
}

// Windows has no such privileges of a program.
std::optional<std::string> trusted_environment(const char* name) {
    const std::wstring key = wide(name);
    const DWORD size = GetEnvironmentVariableW(key.c_str(), nullptr, 0);
    if (size == 0) return std::nullopt;
    std::wstring value(size, L'\0');
    const DWORD length = GetEnvironmentVariableW(key.c_str(), value.data(), size);
    if (length >= size) return std::nullopt;  // changed in between
    value.resize(length);
    return narrow(value);
}

std::string own_folder() {
    std::wstring path(MAX_PATH, L'\0');
    for (;;) {
        const DWORD length =
            GetModuleFileNameW(own_module(), path.data(), static_cast<DWORD>(path.size()));
        if (length == 0) return {};
        if (length < path.size()) {
            path.resize(length);
            break;
        }
        path.resize(path.size() * 2);
    }
    const std::string file = canonical_path(narrow(path));
    return file.substr(0, file.find_last_of("/\\") + 1);
}

// Its own libraries come from its own folder and the system's, never from the working folder or the
// path.
void* open_library(const Descriptor& file, const std::string& path) {
    const auto handle = reinterpret_cast<HANDLE>(_get_osfhandle(file.get()));
    const std::wstring name = final_path(handle);
    if (name.empty()) fail(DEFREC_ERROR_PLUGIN, path, ": ", system_message(GetLastError()));
    HMODULE library = LoadLibraryExW(
        name.c_str(), nullptr, LOAD_LIBRARY_SEARCH_DLL_LOAD_DIR | LOAD_LIBRARY_SEARCH_SYSTEM32);
    if (library == nullptr) fail(DEFREC_ERROR_PLUGIN, path, ": ", system_message(GetLastError()));
    return library;
}

void* find_symbol(void* library, const char* name) noexcept {
    return reinterpret_cast<void*>(GetProcAddress(static_cast<HMODULE>(library), name));
}

}  // namespace defrec::platform
