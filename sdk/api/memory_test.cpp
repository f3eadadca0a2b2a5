// Row 50: memory runs out at the nth allocation, for every n: the call fails with
// DEFREC_ERROR_OUT_OF_MEMORY, nothing leaks, and the next call works. Frames allocate nothing.
// Replaces operator new for the whole process.
#include <doctest/doctest.h>

#include <atomic>
#include <cstdlib>
#include <functional>
#include <vector>

#include "sdk/base/os/aligned_memory.hpp"
#include "sdk/registration/test_organ.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_frames.hpp"
#include "sdk/testing/test_operator_new.hpp"
#include "sdk/testing/test_session.hpp"

namespace {

std::atomic<long> countdown{-1};  // allocations until one fails; negative: none does

std::atomic<bool> destroys{false}, failed_in_destroy{false};

bool fails_now() {
    if (countdown.load(std::memory_order_relaxed) < 0) return false;
    if (countdown.fetch_sub(1) != 0) return false;
    failed_in_destroy = destroys.load();
    return true;
}

// The scope of a destroy function, which does its work without memory as well.
struct Destroying {
    Destroying() { destroys = true; }
    ~Destroying() { destroys = false; }
};

}  // namespace

bool defrec::test::allocation_fails() { return fails_now(); }

namespace {

using namespace defrec;
using namespace defrec::test;

void* host_take(void*, size_t size, size_t alignment) {
    if (fails_now()) return nullptr;
    ++taken;
    ++live;
    return allocate_aligned(size, alignment);
}
void host_give(void*, void* memory) {
    --live;
    free_aligned(memory);
}

// With two small plugins, and the reference if asked for: checking its file takes long under a
// sanitizer.
defrec_status make_context(defrec_context* out, bool with_reference = false) {
    static const std::string good = stub_folder("good").string(),
                             twin = stub_folder("twin").string();
    static const std::string reference =
        std::string(DEFREC_BUILD_DIR) + "/lib/defrec_plugin_reference.json";
    const char* places[] = {good.c_str(), twin.c_str(), reference.c_str()};
    defrec_context_desc desc;
    DEFREC_INIT(&desc);
    desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.threads = 2;
    desc.plugin_paths = places;
    desc.plugin_path_count = with_reference ? 3 : 2;
    desc.alloc = host_take;
    desc.free = host_give;
    return defrec_context_create(&desc, out);
}

// scenario makes something and destroys it again, and returns the first status that was not
// DEFREC_OK.
// Without a failure it is DEFREC_OK; with one DEFREC_ERROR_OUT_OF_MEMORY, or `also` where something
// can be done without.
void check_every_failure(const std::function<defrec_status()>& scenario, long step = 1,
                         defrec_status also = DEFREC_ERROR_OUT_OF_MEMORY) {
    for (int i = 0; i < 2; ++i) REQUIRE(scenario() == DEFREC_OK);
    long n = 0, failures = 0;
    for (;; n += step) {
        long before = live;
        countdown = n;
        defrec_status status = scenario();
        const bool reached = countdown < 0;
        countdown = -1;
        if (reached && live != before) {  // what is kept for ever is kept once
            before = live;
            countdown = n;
            status = scenario();
            countdown = -1;
        }
        if (!reached) {
            REQUIRE(status == DEFREC_OK);
            break;
        }
        failures += status != DEFREC_OK || failed_in_destroy ? 1 : 0;
        const defrec_status expected = failed_in_destroy ? DEFREC_OK : DEFREC_ERROR_OUT_OF_MEMORY;
        if ((status != expected && status != also) || live != before) {
            CAPTURE(n);
            CAPTURE(defrec_last_error());
            CHECK(status == expected);
            CHECK(live == before);
        }
        if (n % 50 == 49) REQUIRE(scenario() == DEFREC_OK);
    }
    MESSAGE(n, " allocations made to fail one by one");
    CHECK(n > 0);
    CHECK(failures > n / step / 2);
    CHECK(scenario() == DEFREC_OK);
}

// Has grown the table of handles and whatever else is kept for ever.
void warm_up() {
    defrec_context contexts[20];
    for (defrec_context& context : contexts) REQUIRE(make_context(&context) == DEFREC_OK);
    for (defrec_context context : contexts) defrec_context_destroy(context);
}

}  // namespace

TEST_CASE("row 50: memory runs out while a context is made") {
    warm_up();
    check_every_failure([] {
        defrec_context context = nullptr;
        const defrec_status status = make_context(&context);
        CHECK((context != nullptr) == (status == DEFREC_OK));
        const Destroying scope;
        defrec_context_destroy(context);
        return status;
    });
}

TEST_CASE("row 50: memory runs out while pairs are registered, or a camera found on its marker") {
    warm_up();
    const double places[] = {0, 0, -50, 60, 10, -30, -40, 30, -35, 10, -45, -20};
    defrec_registration_pairs pairs;
    DEFREC_INIT(&pairs);
    pairs.model_xyz = pairs.seen_xyz = places;
    pairs.count = 4;
    check_every_failure([&] {
        defrec_registration registration = nullptr;
        const defrec_status status = defrec_registration_from_pairs(&pairs, &registration);
        CHECK((registration != nullptr) == (status == DEFREC_OK));
        const Destroying scope;
        defrec_registration_destroy(registration);
        return status;
    });
    double poses[3][12] = {};  // turns about each axis, in the camera's frame: all three fit
    for (int i = 0; i < 3; ++i) {
        poses[i][4 * i + i] = 1;
        poses[i][4 * ((i + 1) % 3) + (i + 2) % 3] = -1;
        poses[i][4 * ((i + 2) % 3) + (i + 1) % 3] = 1;
    }
    defrec_hand_eye_desc desc;
    DEFREC_INIT(&desc);
    desc.flags = DEFREC_HAND_EYE_PAIRED;
    desc.camera_poses = desc.tracker_poses = poses[0];
    desc.camera_count = desc.tracker_count = 3;
    check_every_failure(
        [&] {
            defrec_hand_eye hand_eye = nullptr;
            const defrec_status status = defrec_hand_eye_create(&desc, &hand_eye);
            CHECK((hand_eye != nullptr) == (status == DEFREC_OK));
            const Destroying scope;
            defrec_hand_eye_destroy(hand_eye);
            return status;
        },
        7);
}

TEST_CASE("row 50: memory runs out while a surface is registered") {
    warm_up();
    const defrec::TestMesh mesh =
        defrec::sphere_mesh(2, [](const Eigen::Vector3d& d) { return Eigen::Vector3d(40 * d); });
    std::vector<float> seen = mesh.vertices;
    for (size_t i = 2; i < seen.size(); i += 3) seen[i] += 150;
    defrec_context context = nullptr;
    REQUIRE(make_context(&context) == DEFREC_OK);
    defrec_registration_desc desc;
    DEFREC_INIT(&desc);
    desc.model_vertices = mesh.vertices.data();
    desc.model_vertex_count = mesh.vertices.size() / 3;
    desc.model_triangles = mesh.triangles.data();
    desc.model_triangle_count = mesh.triangles.size() / 3;
    desc.seen_vertices = seen.data();
    desc.seen_count = seen.size() / 3;
    desc.start[0] = desc.start[5] = desc.start[10] = 1;
    desc.start[11] = 150;
    desc.starts = 2;
    check_every_failure(
        [&] {
            defrec_registration registration = nullptr;
            const defrec_status status =
                defrec_registration_from_surface(context, &desc, &registration);
            CHECK((registration != nullptr) == (status == DEFREC_OK));
            const Destroying scope;
            defrec_registration_destroy(registration);
            return status;
        },
        11);
    defrec_context_destroy(context);
}

TEST_CASE("row 50: memory runs out while a rig is made") {
    warm_up();
    defrec_context context = nullptr;
    REQUIRE(make_context(&context) == DEFREC_OK);
    check_every_failure([&] {
        defrec_rig_desc desc = small_rig();
        desc.right.cy += 1;
        defrec_rig rig = nullptr;
        const defrec_status status = defrec_rig_create(context, &desc, &rig);
        const Destroying scope;
        defrec_rig_destroy(rig);
        return status;
    });
    defrec_context_destroy(context);
}

TEST_CASE("row 50: memory runs out while a stage is made, prepared and run") {
    warm_up();
    defrec_context context = nullptr;
    REQUIRE(make_context(&context, true) == DEFREC_OK);
    std::vector<uint8_t> source(65 * 49), gray(65 * 49), mask(65 * 49);
    check_every_failure([&] {
        defrec_rectify_params params;
        DEFREC_INIT(&params);
        params.format = DEFREC_FORMAT_GRAY8;
        params.source_width = 65;
        params.source_height = 49;
        defrec_stage stage = nullptr;
        defrec_status status =
            defrec_stage_create(context, "reference", DEFREC_STAGE_RECTIFY, &params, &stage);
        const defrec_const_buffer in{source.data(), source.size()};
        const defrec_buffer out[] = {{gray.data(), gray.size()}, {mask.data(), mask.size()}};
        if (status == DEFREC_OK) status = defrec_stage_run(stage, &in, 1, out, 2);
        const Destroying scope;
        defrec_stage_destroy(stage);
        return status;
    });
    defrec_context_destroy(context);
}

TEST_CASE("row 50: memory runs out while a tracker is made") {
    warm_up();
    defrec_context context = nullptr;
    REQUIRE(make_context(&context, true) == DEFREC_OK);
    const defrec_rig_desc rig_desc = small_rig();
    defrec_rig rig = nullptr;
    REQUIRE(defrec_rig_create(context, &rig_desc, &rig) == DEFREC_OK);
    check_every_failure([&] {
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.device_id = "reference";
        desc.format = DEFREC_FORMAT_GRAY8;
        desc.disparities = 32;
        defrec_tracker tracker = nullptr;
        const defrec_status status = defrec_tracker_create(context, rig, &desc, &tracker);
        const Destroying scope;
        defrec_tracker_destroy(tracker);
        return status;
    });
    defrec_rig_destroy(rig);
    defrec_context_destroy(context);
}

namespace {

// A window of the scene's images, for the reference takes its time.
constexpr int kSmallWidth = 128, kSmallHeight = 96, kLeftOf = 96, kAbove = 72;

defrec_status track_pair(defrec_tracker tracker, const Pair& pair, int64_t number) {
    defrec_image images[2];
    for (int view = 0; view < 2; ++view) {
        DEFREC_INIT(&images[view]);
        images[view].format = DEFREC_FORMAT_GRAY8;
        images[view].width = kSmallWidth;
        images[view].height = kSmallHeight;
        images[view].stride = kWidth;
        images[view].pixels =
            (view == 0 ? pair.left : pair.right).data() + kAbove * kWidth + kLeftOf;
    }
    defrec_frame frame;
    DEFREC_INIT(&frame);
    frame.timestamp_ns = 1 + 33000000 * number;
    frame.left = &images[0];
    frame.right = &images[1];
    defrec_job job = nullptr;
    defrec_status status = defrec_tracker_submit(tracker, &frame, &job);
    if (status == DEFREC_OK) status = defrec_job_wait(job, UINT64_MAX);
    if (status == DEFREC_OK) {
        defrec_result result;
        DEFREC_INIT(&result);
        status = defrec_job_result(job, &result);
        CHECK((status != DEFREC_OK || result.state == DEFREC_TRACKING));
    }
    defrec_job_release(job);
    return status;
}

// What an application does with one backend from context to file; everything that it makes it
// destroys again.
class Application {
  public:
    explicit Application(const std::string& backend)
        : plugin_(DEFREC_BUILD_DIR "/lib/defrec_plugin_" + backend + ".json"),
          file_((folder_.path() / "surface").string()) {
        for (int i = 0; i < 3; ++i) pairs_.push_back(render(0.4 * i, -0.2 * i));
        defrec_context context = nullptr;
        REQUIRE_OK(make_context(&context));
        defrec_device_info info;
        DEFREC_INIT(&info);
        if (defrec_device_count(context) > 0) {
            REQUIRE_OK(defrec_device_get(context, 0, &info));
            if (info.stages != 0) device_ = info.id;
        }
        defrec_context_destroy(context);
    }
    ~Application() { kept_.destroy(); }
    Application(const Application&) = delete;
    Application& operator=(const Application&) = delete;

    // Whether the machine has what the backend needs.
    bool has_device() const { return !device_.empty(); }

    // Another tracker keeps what the device shares, compiled shaders among it, until the end.
    void keep_device() { REQUIRE_OK(make(kept_)); }

    defrec_status run() const {
        Made made;
        defrec_template surface = nullptr, loaded = nullptr;
        defrec_status status = make(made);
        const defrec_context context = made.context;
        const defrec_tracker tracker = made.tracker;
        for (size_t i = 0; i < pairs_.size() && status == DEFREC_OK; ++i)
            status = track_pair(tracker, pairs_[i], static_cast<int64_t>(i));
        if (status == DEFREC_OK) status = defrec_tracker_get_template(tracker, &surface);
        if (status == DEFREC_OK) status = defrec_template_save(surface, file_.c_str());
        if (status == DEFREC_OK) status = defrec_template_load(context, file_.c_str(), &loaded);
        if (status == DEFREC_OK) status = defrec_tracker_set_template(tracker, loaded);
        // A failure leaves the tracker as usable as it was.
        if (status != DEFREC_OK && tracker != nullptr) {
            CHECK(countdown < 0);
            CHECK(track_pair(tracker, pairs_.back(), 1000) == DEFREC_OK);
        }
        const Destroying scope;
        defrec_template_release(loaded);
        defrec_template_release(surface);
        made.destroy();
        return status;
    }

  private:
    struct Made {
        defrec_context context = nullptr;
        defrec_rig rig = nullptr;
        defrec_tracker tracker = nullptr;
        void destroy() const {
            defrec_tracker_destroy(tracker);
            defrec_rig_destroy(rig);
            defrec_context_destroy(context);
        }
    };

    defrec_status make(Made& out) const {
        defrec_rig_desc rig_desc = scene_rig();
        rig_desc.width = kSmallWidth;
        rig_desc.height = kSmallHeight;
        rig_desc.left.cx = rig_desc.right.cx -= kLeftOf;
        rig_desc.left.cy = rig_desc.right.cy -= kAbove;
        defrec_tracker_desc desc;
        DEFREC_INIT(&desc);
        desc.device_id = device_.c_str();
        desc.format = DEFREC_FORMAT_GRAY8;
        desc.disparities = 32;
        desc.body = DEFREC_BODY_OFF;  // its thread would take part in counting
        defrec_status status = make_context(&out.context);
        if (status == DEFREC_OK) status = defrec_rig_create(out.context, &rig_desc, &out.rig);
        if (status == DEFREC_OK)
            status = defrec_tracker_create(out.context, out.rig, &desc, &out.tracker);
        return status;
    }

    defrec_status make_context(defrec_context* out) const {
        const char* place = plugin_.c_str();
        defrec_context_desc desc;
        DEFREC_INIT(&desc);
        desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
        desc.threads = 1;
        desc.plugin_paths = &place;
        desc.plugin_path_count = 1;
        desc.alloc = host_take;
        desc.free = host_give;
        return defrec_context_create(&desc, out);
    }

    const TemporaryFolder folder_;
    const std::string plugin_, file_;
    std::vector<Pair> pairs_;
    std::string device_;
    Made kept_;
};

}  // namespace

TEST_CASE("row 50: memory runs out anywhere from context to template file, on every backend") {
    warm_up();
    // Each failure costs a few frames, and compiled shaders where the device is opened anew: all of
    // them only where that is asked for.
    const char* asked = std::getenv("DEFREC_TEST_ALLOCATION_STEP");
    const struct {
        std::string backend;
        long step;
        bool keeps_device = false;
    } tried[] = {
        {"reference", 97}, {"cpu", 29}, {"vulkan", 4001}, {"vulkan", 331, true}, {"cuda", 97}};
    for (const auto& [backend, step, keeps_device] : tried) {
        CAPTURE(backend);
        CAPTURE(keeps_device);
        Application application(backend);
        if (!application.has_device()) {
            MESSAGE("skipped: no device");
            continue;
        }
        if (keeps_device) application.keep_device();
        check_every_failure([&] { return application.run(); },
                            asked != nullptr ? std::atol(asked) : step, DEFREC_OK);
    }
}

namespace {

// Gray values as pixels of three channels.
std::vector<uint8_t> as_bgr(const std::vector<uint8_t>& gray) {
    std::vector<uint8_t> pixels;
    for (const uint8_t value : gray) pixels.insert(pixels.end(), 3, value);
    return pixels;
}

void check_frames_allocate_nothing(uint32_t format) {
    CAPTURE(format);
    std::vector<Pair> pairs;
    for (int i = 0; i < 8; ++i) {
        pairs.push_back(render(0.4 * i, -0.2 * i));
        if (format == DEFREC_FORMAT_GRAY8) continue;
        pairs.back().left = as_bgr(pairs.back().left);
        pairs.back().right = as_bgr(pairs.back().right);
    }
    TrackingSession session(
        "cpu", 2,
        [format](defrec_rig_desc&, defrec_tracker_desc& desc) {
            desc.body = DEFREC_BODY_OFF;
            desc.format = format;
        },
        [](defrec_context_desc& desc) {
            desc.alloc = host_take;
            desc.free = host_give;
        });
    double centre[3] = {0, 0, kDepth}, covariance[6];
    defrec_status worst = DEFREC_OK;
    const auto track = [&](const Pair& pair) {
        defrec_job job = nullptr;
        defrec_result result;
        DEFREC_INIT(&result);
        for (const defrec_status status :
             {session.submit({{pair.left.data()}, {pair.right.data()}, {}}, &job),
              defrec_job_wait(job, UINT64_MAX), defrec_job_result(job, &result),
              defrec_job_warp_points(job, centre, 1, centre, nullptr, nullptr),
              defrec_job_point_covariances(job, centre, 1, covariance, nullptr)})
            worst = std::min(worst, status);
        if (result.state != DEFREC_TRACKING) worst = DEFREC_ERROR_INTERNAL;
        defrec_job_release(job);
    };
    // Working memory grows with what the first frames show.
    for (int i = 0; i < 6; ++i) track(pairs[static_cast<size_t>(i)]);
    const long before = taken;
    for (size_t i = 6; i < pairs.size(); ++i) track(pairs[i]);
    const long after = taken;
    REQUIRE(worst == DEFREC_OK);
    CHECK(after == before);
    CHECK(before > 0);
}

}  // namespace

TEST_CASE("once there is a template, frames allocate nothing") {
    for (const uint32_t format : {DEFREC_FORMAT_GRAY8, DEFREC_FORMAT_BGR8})
        check_frames_allocate_nothing(format);
}

TEST_CASE("row 50: memory runs out while points are predicted") {
    warm_up();
    defrec_predictor_desc desc;
    DEFREC_INIT(&desc);
    desc.point_count = 5;
    const double places[15] = {};
    const uint8_t status[5] = {};
    check_every_failure([&] {
        defrec_predictor predictor = nullptr;
        defrec_status result = defrec_predictor_create(&desc, &predictor);
        defrec_predictor_frame frame;
        DEFREC_INIT(&frame);
        frame.state = DEFREC_TRACKING;
        frame.xyz = places;
        frame.status = status;
        frame.count = 5;
        for (int i = 0; i < 30 && result == DEFREC_OK; ++i) {
            frame.timestamp_ns += 33'000'000;
            result = defrec_predictor_add_frame(predictor, &frame);
        }
        double xyz[15];
        if (result == DEFREC_OK)
            result = defrec_predictor_predict(predictor, frame.timestamp_ns, 5, xyz, nullptr,
                                              nullptr, nullptr);
        const Destroying scope;
        defrec_predictor_destroy(predictor);
        return result;
    });
}
