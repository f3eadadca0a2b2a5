// Plugins that throw, hang and lie: the call fails, the application goes on.
#include <dlfcn.h>
#include <doctest/doctest.h>
#include <pthread.h>

#include <cstdlib>
#include <mutex>
#include <string>
#include <vector>

#include "sdk/testing/cut_film.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_frames.hpp"
#include "sdk/testing/test_scene.hpp"
#include "sdk/tracking/test_device.hpp"

#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/lsan_interface.h>
#endif

using namespace defrec::test;

namespace {

// Longer than any call of a device that works.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr uint32_t kDeadlineMs = 20000;
#else
constexpr uint32_t kDeadlineMs = 2000;
#endif

// For a scope: memory that is never freed is no leak.
struct NoLeak {
#if defined(__SANITIZE_ADDRESS__)
    NoLeak() { __lsan_disable(); }
    ~NoLeak() { __lsan_enable(); }
#else
    NoLeak() {}
#endif
};

// The application's log and memory, which it takes away when it is done with the context.
struct Application {
    std::mutex mutex;
    std::string log;
    bool is_gone = false, was_called_when_gone = false;

    static void add(void* user, int32_t, const char*, const char* text) {
        auto& self = *static_cast<Application*>(user);
        const std::lock_guard lock(self.mutex);
        self.log += std::string(text) + "\n";
        self.was_called_when_gone |= self.is_gone;
    }
    static void* alloc(void* user, size_t size, size_t alignment) {
        auto& self = *static_cast<Application*>(user);
        const std::lock_guard lock(self.mutex);
        self.was_called_when_gone |= self.is_gone;
        const NoLeak what_is_left_behind;
        return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    }
    static void free(void* user, void* memory) {
        auto& self = *static_cast<Application*>(user);
        const std::lock_guard lock(self.mutex);
        self.was_called_when_gone |= self.is_gone;
        std::free(memory);
    }
    bool logged(const std::string& text) {
        const std::lock_guard lock(mutex);
        return contains(log, text);
    }
};

std::string library_of(const std::string& plugin) {
    return (stub_folder(plugin) / ("defrec_plugin_" + plugin + ".so")).string();
}

// A context with the plugin "misbehaving", which does as it should at first, and backend cpu; a
// rig.
class Session {
  public:
    explicit Session(const std::string& plugin = "misbehaving") {
        const std::string places[] = {stub_folder(plugin).string(), manifest_of("cpu")};
        const char* pointers[] = {places[0].c_str(), places[1].c_str()};
        defrec_context_desc desc;
        DEFREC_INIT(&desc);
        desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
        desc.plugin_paths = pointers;
        desc.plugin_path_count = 2;
        desc.threads = 2;
        desc.log = Application::add;
        desc.alloc = Application::alloc;
        desc.free = Application::free;
        desc.log_user = desc.alloc_user = &application;
        desc.plugin_deadline_ms = kDeadlineMs;
        REQUIRE(defrec_context_create(&desc, &context) == DEFREC_OK);
        const defrec_rig_desc rig_desc = scene_rig();
        REQUIRE(defrec_rig_create(context, &rig_desc, &rig) == DEFREC_OK);
        library_ = dlopen(library_of(plugin).c_str(), RTLD_NOW);
        REQUIRE(library_ != nullptr);
        behave();
    }
    ~Session() {
        behave();
        end();
        dlclose(library_);
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    // All handles go; what hangs goes on hanging.
    void end() {
        defrec_tracker_destroy(tracker);
        for (defrec_job job : jobs) defrec_job_release(job);
        jobs.clear();
        defrec_rig_destroy(rig);
        defrec_context_destroy(context);
        tracker = nullptr;
        rig = nullptr;
        context = nullptr;
        const std::lock_guard lock(application.mutex);
        application.is_gone = true;
    }

    void misbehave(const char* kind, const char* place) {
        function<void(const char*, const char*)>("defrec_misbehave")(kind, place);
    }
    void behave() { misbehave("", ""); }
    bool is_yet_to_misbehave() const { return function<bool()>("defrec_is_yet_to_misbehave")(); }
    void await_hang() { function<void()>("defrec_await_hang")(); }

    defrec_status make_tracker(const char* device = "misbehaving", uint32_t flags = 0) {
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.device_id = device;
        desc.flags = flags;
        desc.format = DEFREC_FORMAT_GRAY8;
        desc.keep_disparity = 1;
        return defrec_tracker_create(context, rig, &desc, &tracker);
    }
    defrec_status submit(uint32_t flags = 0) {
        defrec_image images[2];
        for (int view = 0; view < 2; ++view) {
            DEFREC_INIT(&images[view]);
            images[view].format = DEFREC_FORMAT_GRAY8;
            images[view].width = kWidth;
            images[view].height = kHeight;
            images[view].pixels = (view == 0 ? pair.left : pair.right).data();
        }
        defrec_frame frame;
        DEFREC_INIT(&frame);
        frame.timestamp_ns = ++time;
        frame.flags = flags;
        frame.left = &images[0];
        frame.right = &images[1];
        defrec_job job = nullptr;
        const defrec_status status = defrec_tracker_submit(tracker, &frame, &job);
        if (job != nullptr) jobs.push_back(job);
        return status;
    }
    // Submitted and waited for; its job is released if it succeeds.
    defrec_status track() {
        const defrec_status status = submit();
        if (status != DEFREC_OK) return status;
        const defrec_status result = defrec_job_wait(jobs.back(), UINT64_MAX);
        if (result == DEFREC_OK) {
            defrec_job_release(jobs.back());
            jobs.pop_back();
        }
        return result;
    }
    // Result of the last job, which is waited for.
    defrec_result result() {
        REQUIRE(defrec_job_wait(jobs.back(), UINT64_MAX) == DEFREC_OK);
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE(defrec_job_result(jobs.back(), &result) == DEFREC_OK);
        return result;
    }
    void release_jobs() {
        for (defrec_job job : jobs) defrec_job_release(job);
        jobs.clear();
    }
    bool is_quarantined(const std::string& id) const {
        for (size_t i = 0; i < defrec_device_count(context); ++i) {
            defrec_device_info info;
            DEFREC_INIT(&info);
            REQUIRE(defrec_device_get(context, i, &info) == DEFREC_OK);
            if (info.id == id) return (info.features & DEFREC_FEATURE_QUARANTINED) != 0;
        }
        return false;
    }

    Application application;
    defrec_context context = nullptr;
    defrec_rig rig = nullptr;
    defrec_tracker tracker = nullptr;
    std::vector<defrec_job> jobs;
    const Pair pair = render(0, 0);
    int64_t time = 0;

  private:
    template <class Signature>
    Signature* function(const char* name) const {
        void* const symbol = dlsym(library_, name);
        REQUIRE(symbol != nullptr);
        return reinterpret_cast<Signature*>(symbol);
    }
    void* library_ = nullptr;
};

std::string last_error() { return defrec_last_error(); }

// A lost tracker and its device: everything says so, nothing waits, another device is at hand.
void check_quarantined(Session& session) {
    CHECK(session.is_quarantined("misbehaving"));
    CHECK_FALSE(session.is_quarantined("cpu"));
    CHECK(session.application.logged("quarantined"));
    defrec_tracker_destroy(session.tracker);
    session.tracker = nullptr;
    session.release_jobs();
    // Never another device in silence.
    CHECK(session.make_tracker() == DEFREC_ERROR_DEVICE_LOST);
    CHECK(contains(last_error(), "quarantined"));
    REQUIRE(session.make_tracker("misbehaving", DEFREC_TRACKER_FALLBACK) == DEFREC_OK);
    CHECK(session.application.logged("passed over"));
    REQUIRE(session.submit() == DEFREC_OK);
    CHECK(std::string(session.result().device_id) == "cpu");
}

// What hangs is left alone; the thread that comes back finds nobody, and calls nobody.
void check_nobody_called(Session& session) {
    session.end();
    session.behave();
    CHECK_FALSE(session.application.was_called_when_gone);
}

}  // namespace

TEST_CASE(
    "rows 25 and 80: what a device's functions throw fails the frame, and the next one works") {
    Session session;
    REQUIRE(session.make_tracker() == DEFREC_OK);
    for (const char* place : {"create", "enqueue", "wait", "write", "read", "signal"}) {
        CAPTURE(place);
        session.misbehave("throw", place);  // "create": the template's stages, in the first frame
        CHECK(session.track() == DEFREC_ERROR_PLUGIN);
        CHECK(contains(last_error(), "threw an exception"));
        session.behave();
        session.release_jobs();
        CHECK(session.track() == DEFREC_OK);
    }
}

TEST_CASE("row 80: what is thrown while a tracker is made is its error") {
    for (const char* place : {"device_open", "buffer_create", "create"}) {
        CAPTURE(place);
        Session session;
        session.misbehave("throw", place);
        CHECK(session.make_tracker() == DEFREC_ERROR_PLUGIN);
        CHECK(contains(last_error(), "threw an exception"));
        session.behave();
        CHECK(session.make_tracker() == DEFREC_OK);
    }
}

TEST_CASE("row 80: what is thrown while things end is logged") {
    for (const char* place :
         {"stage destroy", "queue_destroy", "buffer_destroy", "device_close", "shutdown"}) {
        CAPTURE(place);
        Session session;
        REQUIRE(session.make_tracker() == DEFREC_OK);
        session.misbehave("throw", place);
        session.end();
        CHECK(session.application.logged("threw an exception"));
    }
}

TEST_CASE("row 81: a plugin that throws when it is asked for its devices is refused alone") {
    for (const std::string place : {"entry", "device_count", "device_info", "stage"}) {
        CAPTURE(place);
        Session session("throw_" + place);
        defrec_plugin_info info;
        DEFREC_INIT(&info);
        REQUIRE(defrec_plugin_get(session.context, 0, &info) == DEFREC_OK);
        CHECK(info.verdict == DEFREC_ERROR_PLUGIN);
        CHECK(contains(info.reason, "threw an exception"));
        REQUIRE(session.make_tracker("cpu") == DEFREC_OK);
        CHECK(session.track() == DEFREC_OK);
    }
}

TEST_CASE(
    "row 118: a plugin that ends its thread is a device that does not answer; the host lives") {
    for (const char* place : {"enqueue", "wait", "read"}) {
        CAPTURE(place);
        Session session;
        REQUIRE(session.make_tracker() == DEFREC_OK);
        REQUIRE(session.track() == DEFREC_OK);
        session.misbehave("exit", place);
        CHECK(session.track() == DEFREC_ERROR_DEVICE_LOST);
        CHECK(contains(last_error(), "no answer within"));
        CHECK(session.application.logged("ended the thread that called it"));
        check_quarantined(session);
        check_nobody_called(session);
    }
    for (const char* place : {"device_open", "create"}) {
        CAPTURE(place);
        Session session;
        session.misbehave("exit", place);
        CHECK(session.make_tracker() < 0);
        session.behave();
        CHECK(session.make_tracker("cpu") == DEFREC_OK);
        CHECK(session.track() == DEFREC_OK);
    }
}

TEST_CASE("row 118: a thread of the library that a plugin cancels goes on") {
    Session session;
    REQUIRE(session.make_tracker() == DEFREC_OK);
    for (const char* place : {"create", "enqueue", "wait", "read", "signal"}) {
        CAPTURE(place);
        session.misbehave("cancel", place);
        CHECK(session.track() == DEFREC_OK);
    }
    session.behave();
    CHECK(session.track() == DEFREC_OK);
}

TEST_CASE("row 117: a plugin changes neither the host's floating point mode nor its numbers") {
    std::vector<std::vector<float>> surfaces;
    for (const char* how : {"", "round", "trap"})
        for (const char* place : {"create", "enqueue", "wait", "write", "read", "signal"}) {
            CAPTURE(how);
            CAPTURE(place);
            Session session;
            session.misbehave(how, place);
            REQUIRE(session.make_tracker() == DEFREC_OK);
            REQUIRE(session.submit() == DEFREC_OK);
            REQUIRE(session.submit() == DEFREC_OK);
            const defrec_result result = session.result();
            const auto count = static_cast<std::ptrdiff_t>(3 * result.vertex_count);
            surfaces.emplace_back(result.vertices, result.vertices + count);
            CHECK(session.application.logged("changed the floating point mode") == (*how != 0));
            session.end();
        }
    for (const std::vector<float>& surface : surfaces) CHECK(surface == surfaces.front());
}

TEST_CASE(
    "rows 38 and 79: a frame whose device does not answer fails, and the device is quarantined") {
    for (const char* place : {"enqueue", "wait", "read"}) {
        CAPTURE(place);
        Session session;
        REQUIRE(session.make_tracker() == DEFREC_OK);
        REQUIRE(session.track() == DEFREC_OK);
        session.misbehave("hang", place);
        REQUIRE(session.submit() == DEFREC_OK);
        REQUIRE(session.submit() == DEFREC_OK);
        const defrec_job hanging = session.jobs.front(), queued = session.jobs.back();
        CHECK(defrec_job_wait(hanging, 0) == DEFREC_TIMEOUT);
        CHECK(defrec_job_wait(hanging, UINT64_MAX) == DEFREC_ERROR_DEVICE_LOST);
        CHECK(contains(last_error(), "no answer within"));
        CHECK(defrec_job_wait(queued, UINT64_MAX) == DEFREC_ERROR_DEVICE_LOST);
        defrec_result result;
        DEFREC_INIT(&result);
        CHECK(defrec_job_result(hanging, &result) == DEFREC_ERROR_DEVICE_LOST);
        CHECK(session.submit() == DEFREC_ERROR_DEVICE_LOST);
        check_quarantined(session);
        check_nobody_called(session);
    }
}

TEST_CASE(
    "row 45: a device without memory at any one allocation is an error, and the next call works") {
    for (const std::string place : {"buffer_create", "create"}) {
        CAPTURE(place);
        int in_creation = 0, in_frame = 0;
        for (int allocation = 0;; ++allocation) {
            CAPTURE(allocation);
            Session session;
            session.misbehave("memory", (place + " " + std::to_string(allocation)).c_str());
            const defrec_status made = session.make_tracker();
            if (made != DEFREC_OK) {
                CHECK(made == DEFREC_ERROR_OUT_OF_MEMORY);
                CHECK(session.tracker == nullptr);
                ++in_creation;
                REQUIRE(session.make_tracker() == DEFREC_OK);
            }
            const defrec_status tracked = session.track();  // the first makes its template's stages
            if (tracked != DEFREC_OK) {
                CHECK(made == DEFREC_OK);
                CHECK(tracked == DEFREC_ERROR_OUT_OF_MEMORY);
                ++in_frame;
                session.release_jobs();
                REQUIRE(session.track() == DEFREC_OK);
            }
            CHECK_FALSE(session.is_quarantined("misbehaving"));
            if (session.is_yet_to_misbehave()) break;
        }
        CHECK(in_creation > 0);
        CHECK(in_frame > 0);
    }
}

TEST_CASE("row 79: who asks again and again is told as well") {
    Session session;
    REQUIRE(session.make_tracker() == DEFREC_OK);
    session.misbehave("hang", "enqueue");
    REQUIRE(session.submit() == DEFREC_OK);
    defrec_status status = DEFREC_TIMEOUT;
    while (status == DEFREC_TIMEOUT) status = defrec_job_wait(session.jobs.back(), 0);
    CHECK(status == DEFREC_ERROR_DEVICE_LOST);
    session.behave();
    CHECK(defrec_job_wait(session.jobs.back(), 0) == DEFREC_ERROR_DEVICE_LOST);  // and stays so
}

TEST_CASE("row 47: work that a device never finishes is given up, though it answers") {
    Session session;
    REQUIRE(session.make_tracker() == DEFREC_OK);
    session.misbehave("never", "wait");
    CHECK(session.track() == DEFREC_ERROR_DEVICE_LOST);
    check_quarantined(session);
}

TEST_CASE("row 47: waits that end before their time and the work are told from a slow device") {
    Session session;
    REQUIRE(session.make_tracker() == DEFREC_OK);
    REQUIRE(session.track() == DEFREC_OK);
    session.misbehave("early", "wait");
    CHECK(session.track() == DEFREC_ERROR_PLUGIN);
    CHECK(contains(last_error(), "a wait ended before its time"));
}

TEST_CASE("row 79: a tracker whose device does not answer as it is made is not made") {
    for (const char* place : {"device_open", "buffer_create", "create"}) {
        CAPTURE(place);
        Session session;
        session.misbehave("hang", place);
        CHECK(session.make_tracker() == DEFREC_ERROR_DEVICE_LOST);
        CHECK(contains(last_error(), "no answer within"));
        check_quarantined(session);
    }
}

TEST_CASE("row 79: destroying returns although the plugin does not") {
    for (const char* place :
         {"enqueue", "stage destroy", "queue_destroy", "buffer_destroy", "device_close"}) {
        CAPTURE(place);
        Session session;
        REQUIRE(session.make_tracker() == DEFREC_OK);
        REQUIRE(session.track() == DEFREC_OK);
        session.misbehave("hang", place);
        REQUIRE(session.submit() == DEFREC_OK);
        if (std::string(place) == "enqueue") session.await_hang();
        defrec_tracker_destroy(session.tracker);
        session.tracker = nullptr;
        // The last job keeps the device open.
        const bool is_last = std::string(place) == "device_close";
        CHECK(session.application.logged("quarantined") != is_last);
        check_nobody_called(session);
        CHECK(session.application.logged("left behind"));
    }
}

TEST_CASE("row 79: a plugin that does not shut down is left behind") {
    Session session;
    REQUIRE(session.make_tracker() == DEFREC_OK);
    session.misbehave("hang", "shutdown");
    check_nobody_called(session);
    CHECK(session.application.logged("left behind"));
}

TEST_CASE("row 79: memory is imported and released in bounded time") {
    alignas(64) static uint8_t memory[4096];
    defrec_memory_desc desc;
    DEFREC_INIT(&desc);
    desc.kind = DEFREC_MEMORY_HOST;
    desc.address = memory;
    desc.size = sizeof memory;
    for (const char* place : {"buffer_import", "buffer_destroy"}) {
        CAPTURE(place);
        Session session;
        REQUIRE(session.make_tracker() == DEFREC_OK);
        defrec_memory imported = nullptr;
        if (std::string(place) == "buffer_import") {
            session.misbehave("hang", place);
            CHECK(defrec_memory_import(session.tracker, &desc, &imported) ==
                  DEFREC_ERROR_DEVICE_LOST);
        } else {
            REQUIRE(defrec_memory_import(session.tracker, &desc, &imported) == DEFREC_OK);
            session.misbehave("hang", place);
            defrec_memory_release(imported);
            CHECK(session.application.logged("left behind"));
        }
    }
}

TEST_CASE("row 79: a stage by itself fails in bounded time, and its outputs stay") {
    Session session;
    const defrec_ransac_params params = small_ransac();
    defrec_stage stage = nullptr;
    REQUIRE(defrec_stage_create(session.context, "misbehaving", DEFREC_STAGE_RANSAC, &params,
                                &stage) == DEFREC_OK);
    const std::vector<defrec_landmark> landmarks(10);
    const defrec_const_buffer prepared{landmarks.data(), sizeof(defrec_landmark) * 10};
    REQUIRE(defrec_stage_prepare(stage, &prepared, 1) == DEFREC_OK);
    session.misbehave("hang", "enqueue");
    std::vector<defrec_match> matches(10), weighted(10);
    for (defrec_match& match : weighted) match.feature = 77;
    defrec_ransac_summary summary{};
    const defrec_const_buffer in{matches.data(), sizeof(defrec_match) * 10};
    const defrec_buffer out[] = {{weighted.data(), sizeof(defrec_match) * 10},
                                 {&summary, sizeof summary}};
    CHECK(defrec_stage_run(stage, &in, 1, out, 2) == DEFREC_ERROR_DEVICE_LOST);
    CHECK(weighted[0].feature == 77);
    CHECK(defrec_stage_run(stage, &in, 1, out, 2) == DEFREC_ERROR_DEVICE_LOST);
    CHECK(session.is_quarantined("misbehaving"));
    defrec_stage_destroy(stage);
    session.behave();
    CHECK(weighted[0].feature == 77);  // it works on its own copies
}

TEST_CASE("row 37: a plugin that hangs as it starts is refused, and others work") {
    for (const std::string place : {"entry", "device_count", "device_info"}) {
        CAPTURE(place);
        Session session("hang_" + place);  // lets it go on when it has been refused
        defrec_plugin_info info;
        DEFREC_INIT(&info);
        REQUIRE(defrec_plugin_get(session.context, 0, &info) == DEFREC_OK);
        CHECK(info.verdict == DEFREC_ERROR_PLUGIN);
        CHECK(contains(info.reason, "did not start within"));
        REQUIRE(session.make_tracker("cpu") == DEFREC_OK);
        CHECK(session.track() == DEFREC_OK);
    }
}

TEST_CASE("row 89: a thread that is cancelled while it waits for a job is so when it has waited") {
    struct Waiting {
        Session session;
        defrec_status status = DEFREC_TIMEOUT;
        bool went_on = false;
    } waiting;
    Session& session = waiting.session;
    REQUIRE(session.make_tracker() == DEFREC_OK);
    session.misbehave("hang", "enqueue");
    REQUIRE(session.submit() == DEFREC_OK);
    pthread_t thread;
    const auto body = [](void* argument) -> void* {
        auto& self = *static_cast<Waiting*>(argument);
        self.status = defrec_job_wait(self.session.jobs.back(), UINT64_MAX);
        pthread_testcancel();
        self.went_on = true;
        return nullptr;
    };
    REQUIRE(pthread_create(&thread, nullptr, body, &waiting) == 0);
    REQUIRE(pthread_cancel(thread) == 0);
    void* result = nullptr;
    REQUIRE(pthread_join(thread, &result) == 0);
    CHECK(result == PTHREAD_CANCELED);
    CHECK(waiting.status == DEFREC_ERROR_DEVICE_LOST);
    CHECK_FALSE(waiting.went_on);
    session.behave();
    session.end();
}

TEST_CASE("rows 39 and 82: what a stage never gives fails the frame, which names the stage") {
    struct Lie {
        const char *name, *stage;
        bool is_of_template = false;  // matters only where one is captured
    };
    const Lie lies[] = {
        {"count of features", "orb"},
        {"place of a feature", "orb", true},
        {"level of a feature", "orb", true},
        {"disparity", "stereo", true},
        {"feature of a match", "ransac"},
        {"weight of a match", "ransac"},
        {"inliers", "ransac"},
        {"validity of a patch", "align"},
        {"information of a patch", "align"},
        {"validity of a prediction", "align"},
        {"motion", "lm"},
        {"motion of no length", "lm"},
        {"position", "warp"},
        {"residual", "warp"},
        {"observation", "warp"},
    };
    for (const Lie& lie : lies) {
        CAPTURE(lie.name);
        Session session;
        REQUIRE(session.make_tracker() == DEFREC_OK);
        if (!lie.is_of_template) REQUIRE(session.track() == DEFREC_OK);
        session.misbehave("lie", lie.name);
        CHECK(session.track() == DEFREC_ERROR_PLUGIN);
        CHECK(contains(last_error(), std::string("stage ") + lie.stage + " gave"));
        session.behave();
        session.release_jobs();
        CHECK(session.track() == DEFREC_OK);
    }
}

TEST_CASE(
    "row 78: a template that cannot be adopted fails each frame until it can, or another is") {
    Session session;
    REQUIRE(session.make_tracker() == DEFREC_OK);
    REQUIRE(session.track() == DEFREC_OK);
    defrec_template surface = nullptr;
    REQUIRE(defrec_tracker_get_template(session.tracker, &surface) == DEFREC_OK);
    for (const bool asks_for_another : {false, true}) {
        CAPTURE(asks_for_another);
        defrec_tracker_destroy(session.tracker);
        REQUIRE(session.make_tracker() == DEFREC_OK);
        REQUIRE(defrec_tracker_set_template(session.tracker, surface) == DEFREC_OK);
        session.misbehave("throw", "create");
        for (int frame = 0; frame < 3; ++frame) {
            CHECK(session.track() == DEFREC_ERROR_PLUGIN);
            session.release_jobs();
        }
        session.behave();
        REQUIRE(session.submit(asks_for_another ? DEFREC_FRAME_CAPTURE_TEMPLATE : 0) == DEFREC_OK);
        // A template that was set is found again; one that is captured is there.
        CHECK(session.result().state == (asks_for_another ? DEFREC_TRACKING : DEFREC_RELOCALISED));
        session.release_jobs();
    }
    defrec_template_release(surface);
}

TEST_CASE("row 80: a cut whose stages cannot be made is released in the next frame") {
    const CutFilm film;
    const std::string folder = stub_folder("misbehaving").string();
    const char* path = folder.c_str();
    TrackingSession session("misbehaving", 2, film.describe(), [&](defrec_context_desc& desc) {
        desc.plugin_paths = &path;
        desc.plugin_path_count = 1;
    });
    void* const library = dlopen(library_of("misbehaving").c_str(), RTLD_NOW);
    REQUIRE(library != nullptr);
    void* const symbol = dlsym(library, "defrec_misbehave");
    REQUIRE(symbol != nullptr);
    const auto misbehave = reinterpret_cast<void (*)(const char*, const char*)>(symbol);
    film.track_to_cut(session);
    misbehave("throw", "create");
    TrackingSession::Frame frame;
    frame.left.pixels = film.images().left.data();
    frame.right.pixels = film.images().right.data();
    defrec_job job = nullptr;
    REQUIRE_OK(session.submit(frame, &job));
    CHECK(defrec_job_wait(job, UINT64_MAX) == DEFREC_ERROR_PLUGIN);
    defrec_job_release(job);
    misbehave("", "");
    job = track_images(session, film.images().left, film.images().right);
    defrec_result result;
    DEFREC_INIT(&result);
    REQUIRE_OK(defrec_job_result(job, &result));
    CHECK((result.reasons & DEFREC_REASON_CUT) != 0);
    CHECK(result.template_epoch == 2);
    defrec_job_release(job);
    dlclose(library);
}
