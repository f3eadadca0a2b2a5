// Paths that are not ASCII, and who may change what lies there. The rest of platform.hpp is tested
// through the tests of the loader, which run here, too.
#include <doctest/doctest.h>
// clang-format off: the other needs it first
#include <windows.h>
// clang-format on
#include <immintrin.h>
#include <sddl.h>

#include <algorithm>
#include <string>

#include "sdk/base/os/platform.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/testing/test_files.hpp"

using namespace defrec;
using namespace defrec::test;
namespace fs = std::filesystem;

namespace {

std::string utf8(const fs::path& path) {
    const std::u8string text = path.u8string();
    return {reinterpret_cast<const char*>(text.data()), text.size()};
}

// Sets a file's or folder's access control list, in the security descriptor definition language.
void set_access(const fs::path& path, const wchar_t* list) {
    PSECURITY_DESCRIPTOR security = nullptr;
    REQUIRE(ConvertStringSecurityDescriptorToSecurityDescriptorW(list, SDDL_REVISION_1, &security,
                                                                 nullptr) != 0);
    CHECK(SetFileSecurityW(path.c_str(), DACL_SECURITY_INFORMATION, security) != 0);
    LocalFree(security);
}

template <class Function>
defrec_status status_of(Function function) {
    try {
        function();
    } catch (const Error& error) {
        return error.status();
    }
    return DEFREC_OK;
}

}  // namespace

TEST_CASE("row 75: files and folders are found by names in UTF-8") {
    const TemporaryFolder temporary;
    const fs::path folder = temporary.path() / L"gr\u00f6\u00dfe \u809d\u81d3 \U0001f9e0";
    fs::create_directory(folder);
    const fs::path file = folder / L"\u043f\u0435\u0447\u0435\u043d\u044c.json";
    write_file(file, std::string("{}"));

    CHECK(platform::path_kind(utf8(folder)) == platform::PathKind::kFolder);
    CHECK(platform::path_kind(utf8(file)) == platform::PathKind::kFile);
    CHECK(platform::path_kind(utf8(folder / L"\u00e4")) == platform::PathKind::kMissing);
    REQUIRE(platform::list_folder(utf8(folder)).size() == 1);
    CHECK(platform::list_folder(utf8(folder))[0] == utf8(file.filename()));
    const platform::OpenedFile opened = platform::read_regular_file(utf8(file), 2);
    CHECK(std::string(opened.bytes.begin(), opened.bytes.end()) == "{}");
    CHECK(fs::equivalent(fs::u8path(platform::canonical_path(utf8(file))), file));
}

TEST_CASE("what is not UTF-8, missing, a folder or too large is refused") {
    const TemporaryFolder folder;
    const auto read = [](const std::string& path, uint64_t cap) {
        return status_of([&] { platform::read_regular_file(path, cap); });
    };
    const std::string file = utf8(folder.path() / "file");
    write_file(fs::u8path(file), std::string("12345"));
    CHECK(read(file, 5) == DEFREC_OK);
    CHECK(read(file, 4) == DEFREC_ERROR_PLUGIN);
    CHECK(read(utf8(folder.path()), 5) == DEFREC_ERROR_PLUGIN);
    CHECK(read(file + "2", 5) == DEFREC_ERROR_IO);
    CHECK(read(file + "\xff", 5) == DEFREC_ERROR_IO);
    CHECK(platform::path_kind(file + "\xff") == platform::PathKind::kMissing);
    CHECK(platform::canonical_path(file + "\xff").empty());
    CHECK(status_of([&] { platform::list_folder(file + "2"); }) == DEFREC_ERROR_IO);
}

TEST_CASE("only a path with a drive or a share is absolute") {
    for (const char* path : {"C:\\x", "c:/x", "\\\\host\\share\\x", "//host/share"})
        CHECK_MESSAGE(platform::is_absolute(path), path);
    for (const char* path : {"", "x", "C:x", "C:", "\\x", "/x", ".\\x"})
        CHECK_MESSAGE(!platform::is_absolute(path), path);
    CHECK(platform::name_start("C:\\a/b\\name") == 7);
    CHECK(platform::name_start("name") == 0);
}

TEST_CASE("row 43: who may write is read from access control lists") {
    const TemporaryFolder folder;
    const fs::path file = folder.path() / "file";
    write_file(file, std::string("x"));
    // Full access for administrators and the owner alone; then everybody may read; then write.
    set_access(file, L"D:P(A;;FA;;;BA)(A;;FA;;;OW)");
    CHECK(platform::who_may_change(utf8(file)) == "");
    set_access(file, L"D:P(A;;FA;;;BA)(A;;FR;;;WD)");
    CHECK(platform::who_may_change(utf8(file)) == "");
    set_access(file, L"D:P(A;;FA;;;BA)(A;;FA;;;WD)");
    const std::string who = platform::who_may_change(utf8(file));
    CHECK_MESSAGE(who.find("anybody may write") != std::string::npos, who);
}

TEST_CASE("what is being loaded can neither be written nor replaced") {
    const TemporaryFolder folder;
    const fs::path file = folder.path() / "file";
    write_file(file, std::string("x"));
    const auto opened = platform::read_regular_file(utf8(file), 1);
    std::error_code error;
    fs::rename(file, folder.path() / "other", error);
    CHECK(error);
    CHECK_FALSE(std::ofstream(file).is_open());
}

TEST_CASE("a thread has the default floating point mode, and the caller's own comes back") {
    const uint32_t before = _mm_getcsr();
    _mm_setcsr(before | 0x8040);  // denormals to zero
    uint32_t within = 0, in_thread = 0;
    {
        const platform::DefaultFloatingPoint scope;
        within = _mm_getcsr();
    }
    const uint32_t after = _mm_getcsr();
    platform::start_thread([&] { in_thread = _mm_getcsr(); }).join();
    _mm_setcsr(before);
    CHECK((within & 0x8040) == 0);
    CHECK((after & 0x8040) == 0x8040);
    CHECK((in_thread & 0x8040) == 0);
}

TEST_CASE("the library's threads take over the priority of the thread that starts them") {
    REQUIRE(SetThreadPriority(GetCurrentThread(), THREAD_PRIORITY_HIGHEST) != 0);
    int taken_over = 0, lowered = 0;
    platform::start_thread([&] {
        taken_over = GetThreadPriority(GetCurrentThread());
        platform::lower_priority();
        lowered = GetThreadPriority(GetCurrentThread());
    }).join();
    SetThreadPriority(GetCurrentThread(), THREAD_PRIORITY_NORMAL);
    CHECK(taken_over == THREAD_PRIORITY_HIGHEST);
    CHECK(lowered == THREAD_PRIORITY_BELOW_NORMAL);
}
