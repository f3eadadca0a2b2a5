// Where plugins are looked for, through the C API.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"

using namespace defrec::test;
namespace fs = std::filesystem;

namespace {

struct Log {
    std::mutex mutex;
    std::string text;
    static void write(void* user, int32_t, const char* source, const char* text) {
        auto& log = *static_cast<Log*>(user);
        const std::lock_guard lock(log.mutex);
        log.text.append(source).append(": ").append(text).append("\n");
    }
};

std::vector<std::string> paths_of(const TestContext& context) {
    std::vector<std::string> paths;
    for (size_t i = 0; i < defrec_plugin_count(context.get()); ++i)
        paths.emplace_back(context.plugin(i).path);
    return paths;
}

bool any_from(const TestContext& context, const fs::path& folder) {
    for (const std::string& path : paths_of(context))
        if (path.starts_with(folder.string())) return true;
    return false;
}

class Environment {
  public:
    Environment(const char* name, const std::string& value) : name_(name) {
        setenv(name, value.c_str(), 1);
    }
    ~Environment() { unsetenv(name_); }

  private:
    const char* name_;
};

defrec_context_desc with_flags(uint32_t flags) {
    defrec_context_desc desc;
    DEFREC_INIT(&desc);
    desc.flags = flags;
    desc.threads = 1;
    return desc;
}

}  // namespace

TEST_CASE("the folder of the library itself is searched, unless told not to") {
    CHECK(any_from(TestContext(with_flags(0)), fs::path(DEFREC_BUILD_DIR) / "lib"));
    CHECK(defrec_plugin_count(TestContext(with_flags(DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS)).get()) ==
          0);
}

TEST_CASE("devices come fastest first, the reference last, whatever the order of the search") {
    const std::string lib = std::string(DEFREC_BUILD_DIR) + "/lib/";
    const std::string reference = lib + "defrec_plugin_reference.json";
    const TestContext context({reference, stub_folder("good").string()});
    REQUIRE(defrec_device_count(context.get()) == 2);
    defrec_device_info device;
    DEFREC_INIT(&device);
    REQUIRE(defrec_device_get(context.get(), 0, &device) == DEFREC_OK);
    CHECK(std::string(device.id) == "stub");
    REQUIRE(defrec_device_get(context.get(), 1, &device) == DEFREC_OK);
    CHECK(std::string(device.id) == "reference");
    CHECK(device.stages == (1u << DEFREC_STAGE_COUNT_V1) - 1);
}

TEST_CASE(
    "given places come first and in their order; names within a folder are sorted; each file "
    "counts once") {
    const TemporaryFolder folder;
    for (const char* name :
         {"defrec_plugin_b.json", "defrec_plugin_a.json", "other.json", "defrec_plugin_c.txt"})
        write_file(folder.path() / name, std::string("{"));
    fs::create_symlink(folder.path() / "defrec_plugin_a.json",
                       folder.path() / "defrec_plugin_z.json");
    const std::string good = (stub_folder("good") / "defrec_plugin_good.json").string();
    const TestContext context({good, folder.path().string(), stub_folder("good").string()});
    const std::vector<std::string> expected = {good,
                                               (folder.path() / "defrec_plugin_a.json").string(),
                                               (folder.path() / "defrec_plugin_b.json").string()};
    CHECK(paths_of(context) == expected);
}

TEST_CASE("relative paths, bare names and missing places are reported and not searched") {
    const TemporaryFolder folder;
    const fs::path before = fs::current_path();
    fs::current_path(stub_folder("good"));
    const TestContext context({".", "defrec_plugin_good.json", "defrec_plugin_good.so", "",
                               (folder.path() / "gone").string()});
    fs::current_path(before);
    REQUIRE(defrec_plugin_count(context.get()) == 5);
    for (size_t i = 0; i < 4; ++i) {
        CHECK(context.plugin(i).verdict == DEFREC_ERROR_ARGUMENT);
        CHECK(contains(context.plugin(i).reason, "not an absolute path"));
    }
    CHECK(context.plugin(4).verdict == DEFREC_ERROR_IO);
    CHECK(defrec_device_count(context.get()) == 0);
}

TEST_CASE("row 43: folders and files that anybody may write to are ignored and logged") {
    const TemporaryFolder folder;
    const auto bytes = read_file(stub_folder("good") / "defrec_plugin_good.so");
    const fs::path library = folder.path() / "defrec_plugin_good.so",
                   manifest = folder.path() / "defrec_plugin_good.json";
    write_file(library, bytes);
    write_file(manifest, manifest_text("defrec_plugin_good.so", bytes));
    Log log;
    const std::string place = folder.path().string();
    const char* places[] = {place.c_str()};
    defrec_context_desc desc = with_flags(DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS);
    desc.plugin_paths = places;
    desc.plugin_path_count = 1;
    desc.log = Log::write;
    desc.log_user = &log;
    const auto verdict = [&] { return TestContext(desc).plugin(0).verdict; };
    CHECK(verdict() == DEFREC_OK);
    CHECK(log.text.empty());
    for (const fs::path& open : {folder.path(), library, manifest}) {
        const fs::perms before = fs::status(open).permissions();
        fs::permissions(open, fs::perms::others_write, fs::perm_options::add);
        CHECK(verdict() == DEFREC_ERROR_PLUGIN);
        CHECK(contains(log.text,
                       std::string("sdk: ").append(open.string()).append(": anybody may write")));
        fs::permissions(open, before);
    }
    CHECK(verdict() == DEFREC_OK);
}

TEST_CASE("row 42: the environment counts only where the application allows it") {
    std::string places = ":";
    places.append(stub_folder("good").string()).append("::relative:");
    const Environment path("DEFREC_PLUGIN_PATH", places);
    CHECK(!any_from(TestContext(with_flags(0)), stub_folder("good")));
    CHECK(!any_from(
        TestContext(with_flags(DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS | DEFREC_CONTEXT_USE_ENVIRONMENT)),
        stub_folder("good")));
    const TestContext context(with_flags(DEFREC_CONTEXT_USE_ENVIRONMENT));
    CHECK(any_from(context, stub_folder("good")));
    CHECK(context.plugin(0).verdict == DEFREC_OK);
    CHECK(context.plugin(1).verdict == DEFREC_ERROR_ARGUMENT);
}

namespace {
std::string output_of(const std::string& command) {
    FILE* pipe = popen(command.c_str(), "r");
    REQUIRE(pipe != nullptr);
    std::string text;
    for (int c = fgetc(pipe); c != EOF; c = fgetc(pipe)) text += char(c);
    pclose(pipe);
    return text;
}
}  // namespace

TEST_CASE(
    "row 42: a process with privileges of its own ignores the environment even where it is "
    "allowed") {
    const Environment path("DEFREC_PLUGIN_PATH", stub_folder("good").string());
    const fs::path probe = fs::path(DEFREC_BUILD_DIR) / "bin" / "defrec_privileged_probe";
    CHECK(output_of(probe.string()) == "1\n");
    if (geteuid() != 0) {
        MESSAGE("skipped: only root can run a program for another user with its own rights");
        return;
    }
    // As if another user had started a set-uid program of root's, which may read what root may,
    // wherever the build lies. LeakSanitizer cannot look into such a process, and says so.
    CHECK(output_of("setpriv --ruid=65534 " + probe.string() + " 2>/dev/null") == "0\n");
}

namespace {

// The plugin "good" in a folder of its own.
struct PluginFolder {
    PluginFolder() {
        write_file(library, bytes);
        write_file(manifest, manifest_text("defrec_plugin_good.so", bytes));
    }
    const TemporaryFolder folder;
    const fs::path library = folder.path() / "defrec_plugin_good.so",
                   manifest = folder.path() / "defrec_plugin_good.json";
    const std::vector<unsigned char> bytes =
        read_file(stub_folder("good") / "defrec_plugin_good.so");
};

}  // namespace

TEST_CASE("row 83: the checks of a folder hold for a manifest named as a file, and behind links") {
    const PluginFolder plugin;
    const TemporaryFolder elsewhere;
    const fs::path link = elsewhere.path() / "defrec_plugin_good.json",
                   folder_link = elsewhere.path() / "plugins";
    fs::create_symlink(plugin.manifest, link);
    fs::create_symlink(plugin.folder.path(), folder_link);
    const std::string places[] = {plugin.manifest.string(), folder_link.string(),
                                  (folder_link / "defrec_plugin_good.json").string()};
    for (const std::string& place : places) {
        CAPTURE(place);
        CHECK(TestContext({place}).plugin(0).verdict == DEFREC_OK);
        fs::permissions(plugin.folder.path(), fs::perms::others_write, fs::perm_options::add);
        const TestContext refused({place});
        CHECK(refused.plugin(0).verdict == DEFREC_ERROR_PLUGIN);
        CHECK(contains(refused.plugin(0).reason, "anybody may write to this folder"));
        fs::permissions(plugin.folder.path(), fs::perms::others_write, fs::perm_options::remove);
    }
}

TEST_CASE("row 83: a folder above that anybody may write to is as bad") {
    const PluginFolder plugin;
    const fs::path inner = plugin.folder.path() / "inner";
    fs::create_directory(inner);
    for (const fs::path& file : {plugin.library, plugin.manifest})
        fs::rename(file, inner / file.filename());
    CHECK(TestContext({inner.string()}).plugin(0).verdict == DEFREC_OK);
    fs::permissions(plugin.folder.path(), fs::perms::others_write, fs::perm_options::add);
    CHECK(TestContext({inner.string()}).plugin(0).verdict == DEFREC_ERROR_PLUGIN);
}

TEST_CASE("rows 43 and 83: files of other users, and that other groups may write to") {
    const PluginFolder plugin;
    constexpr uid_t kOther = 54321;
    if (geteuid() != 0) {
        MESSAGE("only the superuser can give files away");
        return;
    }
    for (const fs::path& owned : {plugin.folder.path(), plugin.library, plugin.manifest}) {
        CAPTURE(owned.string());
        REQUIRE(chown(owned.c_str(), kOther, gid_t(-1)) == 0);
        CHECK(contains(TestContext({plugin.manifest.string()}).plugin(0).reason,
                       "another user (number 54321) may write"));
        REQUIRE(chown(owned.c_str(), 0, kOther) == 0);
        CHECK(TestContext({plugin.manifest.string()}).plugin(0).verdict == DEFREC_OK);
        fs::permissions(owned, fs::perms::group_write, fs::perm_options::add);
        CHECK(contains(TestContext({plugin.manifest.string()}).plugin(0).reason,
                       "another group (number 54321) may write"));
        fs::permissions(owned, fs::perms::group_write, fs::perm_options::remove);
    }
}

namespace {

// Why the plugin "good" is refused where `count` descriptors can be opened.
std::string refusal_with_descriptors(rlim_t count) {
    const PluginFolder plugin;
    const int lowest = open("/dev/null", O_RDONLY | O_CLOEXEC);
    REQUIRE(lowest >= 0);
    close(lowest);
    rlimit before{};
    REQUIRE(getrlimit(RLIMIT_NOFILE, &before) == 0);
    const rlimit few{static_cast<rlim_t>(lowest) + count, before.rlim_max};
    std::string reason;
    REQUIRE(setrlimit(RLIMIT_NOFILE, &few) == 0);
    {
        const TestContext context({plugin.folder.path().string()});
        if (defrec_plugin_count(context.get()) == 1) reason = context.plugin(0).reason;
    }
    REQUIRE(setrlimit(RLIMIT_NOFILE, &before) == 0);
    return reason;
}

}  // namespace

TEST_CASE("row 98: without descriptors the reason is that, and not that there is no plugin") {
    const std::string reason = refusal_with_descriptors(0);
    CHECK_MESSAGE(contains(reason, "Too many open files"), reason);
}

TEST_CASE("row 98: with one descriptor the loader's reason names the library, and not by it") {
    const std::string reason = refusal_with_descriptors(1);
    CHECK_MESSAGE(contains(reason, "defrec_plugin_good.so: cannot open"), reason);
    CHECK_MESSAGE(contains(reason, "Too many open files"), reason);
    CHECK_MESSAGE(!contains(reason, "/proc/"), reason);
}

TEST_CASE("row 104: what is loaded is the file whose hash was taken, whatever has its name") {
    const PluginFolder plugin;
    const auto other = read_file(stub_folder("twin") / "defrec_plugin_twin.so");
    // Never written where it lies: what is loaded would lose its own pages, too.
    const auto replace = [&](const std::vector<unsigned char>& bytes) {
        const fs::path fresh = plugin.folder.path() / "fresh";
        write_file(fresh, bytes);
        fs::rename(fresh, plugin.library);
    };
    std::atomic<bool> done{false};
    std::thread swapper([&] {
        for (size_t i = 0; !done; ++i) replace(i % 2 == 0 ? other : plugin.bytes);
    });
    size_t loaded = 0;
    for (int i = 0; i < 300; ++i) {
        const TestContext context({plugin.manifest.string()});
        const std::string reason = context.plugin(0).reason;
        loaded += reason.empty();
        // Either file, and no other than the manifest means; a plugin of another name would be the
        // other file, loaded.
        CHECK_MESSAGE(!contains(reason, "calls itself"), reason);
    }
    done = true;
    swapper.join();
    replace(plugin.bytes);
    CHECK(TestContext({plugin.manifest.string()}).plugin(0).verdict == DEFREC_OK);
    MESSAGE(loaded, " of 300 were loaded");
}
