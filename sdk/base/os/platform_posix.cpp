// platform.hpp on Linux and other POSIX systems.
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cfenv>
#include <cstdlib>
#include <cstring>
#include <map>
#include <memory>
#include <mutex>
#include <system_error>

#include "sdk/base/os/descriptor.hpp"
#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/error.hpp"

namespace defrec::platform {
namespace {

// But for those by which Mono stops threads during a collection: it waits for ever for a thread
// that has been in a callback and blocks them.
class SignalsBlocked {
  public:
    SignalsBlocked() {
        sigset_t blocked;
        sigfillset(&blocked);
        // What a thread's own instruction raises ends the process unseen where it is blocked.
        for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGTRAP, SIGSYS})
            sigdelset(&blocked, signal);
        for (int signal = SIGRTMIN; signal <= SIGRTMAX; ++signal) sigdelset(&blocked, signal);
        sigdelset(&blocked, SIGXCPU);
#ifdef SIGPWR
        sigdelset(&blocked, SIGPWR);
#endif
        pthread_sigmask(SIG_SETMASK, &blocked, &before_);
    }
    ~SignalsBlocked() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
    SignalsBlocked(const SignalsBlocked&) = delete;
    SignalsBlocked& operator=(const SignalsBlocked&) = delete;

  private:
    sigset_t before_;
};

}  // namespace

// The kernel clears the page in a child; how it came to be, and its number, do not matter.
uint64_t process_id() noexcept {
    static std::atomic<uint64_t> last{0};
    static auto* const page = [] {
        const auto size = static_cast<size_t>(sysconf(_SC_PAGESIZE));
        void* memory =
            mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        if (memory == MAP_FAILED) return static_cast<std::atomic<uint64_t>*>(nullptr);
        if (madvise(memory, size, MADV_WIPEONFORK) != 0) {
            munmap(memory, size);
            return static_cast<std::atomic<uint64_t>*>(nullptr);
        }
        return new (memory) std::atomic<uint64_t>(0);
    }();
    if (page == nullptr) return static_cast<uint64_t>(getpid());
    uint64_t id = *page;
    if (id == 0) {
        const uint64_t fresh = ++last;
        if (page->compare_exchange_strong(id, fresh)) return fresh;
    }
    return id;
}

std::thread start_thread(std::function<void()> body) {
    const SignalsBlocked blocked;  // a thread inherits the mask
    try {
        return std::thread([run = std::move(body)] {
            // A plugin that asks for it must not end it anywhere.
            pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, nullptr);
            std::fesetenv(FE_DFL_ENV);
            run();
        });
    } catch (const std::system_error& error) {
        fail(DEFREC_ERROR_OUT_OF_MEMORY, "cannot start a thread: ", error.what());
    }
}

void lower_priority() noexcept {
    const sched_param normal{};
    (void)pthread_setschedparam(pthread_self(), SCHED_OTHER, &normal);
    // Linux has a nice value for each thread, 0 being the one that calls.
    constexpr int kNice = 10;
    (void)setpriority(PRIO_PROCESS, 0, std::max(kNice, getpriority(PRIO_PROCESS, 0)));
}

DefaultFloatingPoint::DefaultFloatingPoint() noexcept {
    static_assert(sizeof(std::fenv_t) <= sizeof saved_ && alignof(std::fenv_t) <= 16);
    std::fegetenv(reinterpret_cast<std::fenv_t*>(saved_));
    std::fesetenv(FE_DFL_ENV);
}
DefaultFloatingPoint::~DefaultFloatingPoint() {
    std::fesetenv(reinterpret_cast<const std::fenv_t*>(saved_));
}

NoCancellation::NoCancellation() noexcept {
    pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, &before_);
}
NoCancellation::~NoCancellation() { pthread_setcancelstate(before_, nullptr); }

namespace {

// Raised by a thread's own write, so its mask is enough.
class FileSizeSignalBlocked {
  public:
    FileSizeSignalBlocked() {
        sigset_t pending;
        sigpending(&pending);
        was_pending_ = sigismember(&pending, SIGXFSZ) == 1;
        sigemptyset(&signal_);
        sigaddset(&signal_, SIGXFSZ);
        pthread_sigmask(SIG_BLOCK, &signal_, &before_);
    }
    ~FileSizeSignalBlocked() {
        const timespec at_once{};
        while (!was_pending_ && sigtimedwait(&signal_, nullptr, &at_once) < 0 && errno == EINTR) {
        }
        pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    }
    FileSizeSignalBlocked(const FileSizeSignalBlocked&) = delete;
    FileSizeSignalBlocked& operator=(const FileSizeSignalBlocked&) = delete;

  private:
    bool was_pending_ = false;
    sigset_t signal_{}, before_{};
};

}  // namespace

void without_file_size_signal(const std::function<void()>& body) {
    const FileSizeSignalBlocked blocked;
    body();
}

void spin_pause() noexcept {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

std::chrono::microseconds sleep_error() noexcept { return std::chrono::microseconds(125); }

size_t name_start(std::string_view path) noexcept { return path.find_last_of('/') + 1; }

char list_separator() noexcept { return ':'; }

PathKind path_kind(const std::string& path) noexcept {
    struct stat info;
    if (stat(path.c_str(), &info) != 0) return PathKind::kMissing;
    return S_ISREG(info.st_mode)   ? PathKind::kFile
           : S_ISDIR(info.st_mode) ? PathKind::kFolder
                                   : PathKind::kOther;
}

namespace {

// The system's, this process's, and those of this library, whose code runs here anyway.
struct Owners {
    uid_t users[3] = {0, geteuid(), 0};
    gid_t groups[3] = {0, getegid(), 0};
    Owners() {
        Dl_info info;
        struct stat own;
        if (dladdr(reinterpret_cast<const void*>(&own_folder), &info) == 0 ||
            info.dli_fname == nullptr || stat(info.dli_fname, &own) != 0)
            return;
        users[2] = own.st_uid;
        groups[2] = own.st_gid;
    }
};

// Empty where nobody else may. is_above: a folder above what matters, in which a sticky bit keeps
// others from replacing what is not theirs.
std::string who_may_write(const std::string& path, const Owners& owners, bool is_above) {
    struct stat info;
    if (stat(path.c_str(), &info) != 0) return {};
    if (std::count(std::begin(owners.users), std::end(owners.users), info.st_uid) == 0)
        return concat("another user (number ", info.st_uid, ") may write");
    if (is_above && (info.st_mode & S_ISVTX) != 0) return {};
    if ((info.st_mode & S_IWOTH) != 0) return "anybody may write";
    if ((info.st_mode & S_IWGRP) != 0 &&
        std::count(std::begin(owners.groups), std::end(owners.groups), info.st_gid) == 0)
        return concat("another group (number ", info.st_gid, ") may write");
    return {};
}

}  // namespace

std::string who_may_change(const std::string& path) {
    const Owners owners;
    const bool is_folder = path_kind(path) == PathKind::kFolder;
    const char* const what = is_folder ? " to this folder" : " to this file";
    const std::string who = who_may_write(path, owners, false);
    if (!who.empty()) return concat(path, ": ", who, what);
    const std::string own = own_folder();
    std::string real = canonical_path(path);
    for (size_t end = real.find_last_of('/'), above = is_folder ? 1 : 0;
         end != std::string::npos && !real.empty(); end = real.find_last_of('/'), ++above) {
        real.resize(end);
        const std::string folder = real.empty() ? "/" : real;
        // Who may change what lies above this library may change it as well.
        if (above > 0 && own.starts_with(real + "/")) continue;
        const std::string other = who_may_write(folder, owners, above > 0);
        if (!other.empty()) return concat(folder, ": ", other, " to this folder");
    }
    return {};
}

bool is_absolute(std::string_view path) noexcept { return !path.empty() && path.front() == '/'; }

std::string canonical_path(const std::string& path) {
    const std::unique_ptr<char, decltype(&std::free)> real(realpath(path.c_str(), nullptr),
                                                           std::free);
    return real == nullptr ? std::string() : std::string(real.get());
}

std::vector<std::string> list_folder(const std::string& path) {
    const std::unique_ptr<DIR, int (*)(DIR*)> folder(opendir(path.c_str()), closedir);
    if (folder == nullptr) fail(DEFREC_ERROR_IO, path, ": ", std::strerror(errno));
    std::vector<std::string> names;
    while (const dirent* entry = readdir(folder.get())) names.emplace_back(entry->d_name);
    std::sort(names.begin(), names.end());
    return names;
}

OpenedFile read_regular_file(const std::string& path, uint64_t cap) {
    Descriptor file{open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)};
    if (!file) fail(DEFREC_ERROR_IO, path, ": ", std::strerror(errno));
    struct stat info;
    if (fstat(file.get(), &info) != 0) fail(DEFREC_ERROR_IO, path, ": ", std::strerror(errno));
    if (!S_ISREG(info.st_mode)) fail(DEFREC_ERROR_PLUGIN, path, ": not a regular file");
    const auto size = static_cast<uint64_t>(info.st_size);
    if (size > cap)
        fail(DEFREC_ERROR_PLUGIN, path, ": ", size, " bytes, at most ", cap, " are read");
    std::vector<unsigned char> bytes(size);
    uint64_t have = 0;
    while (have < size) {
        const ssize_t count = read(file.get(), bytes.data() + have, size - have);
        if (count < 0 && errno == EINTR) continue;
        if (count < 0) fail(DEFREC_ERROR_IO, path, ": ", std::strerror(errno));
        if (count == 0) break;
        have += static_cast<uint64_t>(count);
    }
    bytes.resize(have);
    return {std::move(file), std::move(bytes)};
}

std::optional<std::string> trusted_environment(const char* name) {
    const char* value = secure_getenv(name);
    return value == nullptr ? std::nullopt : std::optional<std::string>(value);
}

std::string own_folder() {
    Dl_info info;
    if (dladdr(reinterpret_cast<const void*>(&own_folder), &info) == 0 || info.dli_fname == nullptr)
        return {};
    const std::string file = canonical_path(info.dli_fname);
    return file.substr(0, file.find_last_of('/') + 1);
}

// The loader takes two libraries of one name for the same, and numbers of descriptors come again:
// each name is another way to write the same path, with bits as "/." and "/": those of a count, and
// of where it lies, for a process may hold this library twice. The loader keeps every name it was
// given, so a file that it has already is asked for by the name that it had.
void* open_library(const Descriptor& file, const std::string& path) {
    static std::mutex mutex;
    static std::map<std::array<int64_t, 5>, std::string> names;  // of files that are loaded
    static std::atomic<uint16_t> count{0};
    struct stat info;
    if (fstat(file.get(), &info) != 0) fail(DEFREC_ERROR_IO, path, ": ", std::strerror(errno));
    const std::array<int64_t, 5> identity{
        static_cast<int64_t>(info.st_dev), static_cast<int64_t>(info.st_ino),
        static_cast<int64_t>(info.st_size), static_cast<int64_t>(info.st_ctim.tv_sec),
        static_cast<int64_t>(info.st_ctim.tv_nsec)};
    std::string name;
    {
        const std::lock_guard lock(mutex);
        if (const auto known = names.find(identity); known != names.end()) name = known->second;
    }
    if (name.empty()) {
        name = "/proc/self/fd";
        const auto place = static_cast<uint64_t>(reinterpret_cast<uintptr_t>(&count));
        for (uint64_t bits = place << 16 | count++; bits != 0; bits >>= 1)
            name += (bits & 1) != 0 ? "/." : "/";
        name += concat("/", file.get());
        if (access(name.c_str(), R_OK) != 0) name = path;  // there is no /proc
    }
    void* library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    if (library == nullptr) {
        const char* told = dlerror();
        std::string reason = told == nullptr ? "cannot be loaded" : told;
        if (reason.starts_with(name + ": ")) reason.erase(0, name.size() + 2);
        for (size_t at = reason.find(name); at != std::string::npos; at = reason.find(name))
            reason.replace(at, name.size(), path, name_start(path));
        fail(DEFREC_ERROR_PLUGIN, path, ": ", reason);
    }
    const std::lock_guard lock(mutex);
    names.emplace(identity, name);
    return library;
}

void* find_symbol(void* library, const char* name) noexcept { return dlsym(library, name); }

}  // namespace defrec::platform
