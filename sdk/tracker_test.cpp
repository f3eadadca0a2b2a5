// The tracker through the C API, on a textured plane that is moved: states, reasons, queue, templates, repeatability.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "include/defrec_c.h"

namespace {

constexpr int kWidth = 320, kHeight = 240;
constexpr double kFocal = 340, kBaseline = 5, kDepth = 80, kSlope = 0.15;

double hash_noise(int64_t x, int64_t y, uint64_t octave) {
    uint64_t h = static_cast<uint64_t>(x) * 0x9e3779b97f4a7c15u ^ static_cast<uint64_t>(y) * 0xc2b2ae3d27d4eb4fu ^ octave * 0x165667b19e3779f9u;
    h ^= h >> 29;
    h *= 0xbf58476d1ce4e5b9u;
    h ^= h >> 32;
    return static_cast<double>(h & 0xffff) / 65535.0 - 0.5;
}

double smooth_noise(double x, double y, uint64_t octave) {
    const double fx = std::floor(x), fy = std::floor(y);
    const auto ix = static_cast<int64_t>(fx), iy = static_cast<int64_t>(fy);
    const auto ease = [](double t) { return t * t * (3 - 2 * t); };
    const double a = ease(x - fx), b = ease(y - fy);
    return (1 - b) * ((1 - a) * hash_noise(ix, iy, octave) + a * hash_noise(ix + 1, iy, octave)) +
           b * ((1 - a) * hash_noise(ix, iy + 1, octave) + a * hash_noise(ix + 1, iy + 1, octave));
}

// Gray value of the material at X, Y mm.
double texture(double x, double y) {
    double value = 0;
    for (uint64_t octave = 0; octave < 4; ++octave) {
        const double scale = 0.35 * static_cast<double>(1u << octave);
        value += smooth_noise(x * scale, y * scale, octave) * 70 / static_cast<double>(1u << (octave / 2));
    }
    return std::clamp(125 + value, 0.0, 255.0);
}

struct Pair {
    std::vector<uint8_t> left = std::vector<uint8_t>(kWidth * kHeight), right = left;
};

// The plane z = kDepth + kSlope x, its material moved by (dx, dy) mm along x and y. noise: gray levels.
Pair render(double dx, double dy, double noise = 0, uint64_t seed = 0) {
    Pair pair;
    for (int eye = 0; eye < 2; ++eye) {
        const double origin = eye * kBaseline;
        std::vector<uint8_t>& image = eye == 0 ? pair.left : pair.right;
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const double u = (x - kWidth / 2) / kFocal, v = (y - kHeight / 2) / kFocal;
                const double z = (kDepth + kSlope * origin) / (1 - kSlope * u);
                const double gray = texture(origin + u * z - dx, v * z - dy) +
                                    2 * noise * hash_noise(x + 1000 * eye, y, seed + 77);
                image[static_cast<size_t>(y * kWidth + x)] = static_cast<uint8_t>(std::lround(std::clamp(gray, 0.0, 255.0)));
            }
    }
    return pair;
}

#define REQUIRE_OK(call) REQUIRE_MESSAGE((call) == DEFREC_OK, defrec_last_error())

struct Session {
    defrec_context context = nullptr;
    defrec_rig rig = nullptr;
    defrec_tracker tracker = nullptr;
    int64_t time = 0;

    explicit Session(const char* device = "cpu", uint32_t threads = 2) {
        defrec_context_desc context_desc;
        DEFREC_INIT(&context_desc);
        context_desc.threads = threads;
        REQUIRE_OK(defrec_context_create(&context_desc, &context));
        defrec_rig_desc rig_desc;
        DEFREC_INIT(&rig_desc);
        rig_desc.width = kWidth;
        rig_desc.height = kHeight;
        rig_desc.left.fx = rig_desc.left.fy = kFocal;
        rig_desc.left.cx = kWidth / 2;
        rig_desc.left.cy = kHeight / 2;
        rig_desc.right = rig_desc.left;
        rig_desc.rotation[0] = rig_desc.rotation[4] = rig_desc.rotation[8] = 1;
        rig_desc.translation[0] = -kBaseline;
        REQUIRE_OK(defrec_rig_create(context, &rig_desc, &rig));
        defrec_tracker_desc tracker_desc;
        DEFREC_INIT(&tracker_desc);
        tracker_desc.device_id = device;
        tracker_desc.format = DEFREC_FORMAT_GRAY8;
        REQUIRE_OK(defrec_tracker_create(context, rig, &tracker_desc, &tracker));
    }
    ~Session() {
        defrec_tracker_destroy(tracker);
        defrec_rig_destroy(rig);
        defrec_context_destroy(context);
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    defrec_status submit(const Pair& pair, defrec_job* job, const std::vector<uint8_t>* ignore = nullptr, uint32_t flags = 0) {
        defrec_image images[3];
        const uint8_t* pixels[3] = {pair.left.data(), pair.right.data(), ignore != nullptr ? ignore->data() : nullptr};
        for (int i = 0; i < 3; ++i) {
            DEFREC_INIT(&images[i]);
            images[i].format = DEFREC_FORMAT_GRAY8;
            images[i].width = kWidth;
            images[i].height = kHeight;
            images[i].pixels = pixels[i];
        }
        defrec_frame frame;
        DEFREC_INIT(&frame);
        frame.timestamp_ns = time += 33000000;
        frame.flags = flags;
        frame.left = &images[0];
        frame.right = &images[1];
        frame.ignore = ignore != nullptr ? &images[2] : nullptr;
        return defrec_tracker_submit(tracker, &frame, job);
    }
    // One frame from submission to result; the job is released.
    struct Frame {
        uint32_t state, reasons, epoch, patches, features;
        std::vector<float> vertices;
        std::vector<uint8_t> status;
        double shift[3];
    };
    Frame track(const Pair& pair, const std::vector<uint8_t>* ignore = nullptr, uint32_t flags = 0) {
        defrec_job job = nullptr;
        REQUIRE_OK(submit(pair, &job, ignore, flags));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        Frame frame{result.state, result.reasons, result.epoch, result.patches, result.features, {}, {}, {0, 0, 0}};
        if (result.vertex_count > 0) {
            frame.vertices.assign(result.vertices, result.vertices + 3 * result.vertex_count);
            frame.status.assign(result.vertex_status, result.vertex_status + result.vertex_count);
            const double centre[3] = {0, 0, kDepth};
            double moved[3];
            REQUIRE_OK(defrec_job_warp_points(job, centre, 1, moved, nullptr, nullptr));
            for (int axis = 0; axis < 3; ++axis) frame.shift[axis] = moved[axis] - centre[axis];
        }
        defrec_job_release(job);
        return frame;
    }
};

bool usable(uint32_t state) { return state == DEFREC_TRACKING || state == DEFREC_DEGRADED || state == DEFREC_RELOCALISED; }

}  // namespace

TEST_CASE("the first frame gives the template, and a moving surface is followed") {
    Session session;
    const Session::Frame first = session.track(render(0, 0));
    CHECK(first.state == DEFREC_TRACKING);
    CHECK(first.epoch == 1);
    for (const double shift : first.shift) CHECK(std::abs(shift) < 0.1);
    for (int i = 1; i <= 6; ++i) {
        const Session::Frame frame = session.track(render(0.7 * i, -0.4 * i));
        CAPTURE(i);
        CHECK(frame.state == DEFREC_TRACKING);
        CHECK(std::abs(frame.shift[0] - 0.7 * i) < 0.15);
        CHECK(std::abs(frame.shift[1] + 0.4 * i) < 0.15);
    }
}

TEST_CASE("row 64: a sudden shift of ten millimetres between two frames is found in the same frame") {
    Session session;
    session.track(render(0, 0));
    const Session::Frame frame = session.track(render(10, 3));
    CHECK(usable(frame.state));
    CHECK((frame.reasons & DEFREC_REASON_FAST_MOTION) != 0);
    CHECK(std::abs(frame.shift[0] - 10) < 0.3);
    CHECK(std::abs(frame.shift[1] - 3) < 0.3);
}

TEST_CASE("rows 58 and 63: black frames are lost at once, and the surface is found again when it returns") {
    Session session;
    session.track(render(0, 0));
    const uint32_t epoch = session.track(render(0.5, 0)).epoch;
    Pair black;
    for (int i = 0; i < 3; ++i) {
        const Session::Frame frame = session.track(black);
        CHECK(frame.state == DEFREC_LOST);
        CHECK((frame.reasons & DEFREC_REASON_DARK) != 0);
        for (const uint8_t status : frame.status) CHECK(status == DEFREC_POINT_UNKNOWN);
    }
    const Session::Frame back = session.track(render(4, 2));
    CHECK(back.state == DEFREC_RELOCALISED);
    CHECK(back.epoch == epoch + 1);
    CHECK(std::abs(back.shift[0] - 4) < 0.3);
    CHECK(session.track(render(4, 2, 1, 5)).state == DEFREC_TRACKING);
}

TEST_CASE("row 58: white frames are lost and say why") {
    Session session;
    session.track(render(0, 0));
    Pair white;
    std::fill(white.left.begin(), white.left.end(), uint8_t{255});
    white.right = white.left;
    const Session::Frame frame = session.track(white);
    CHECK(frame.state == DEFREC_LOST);
    CHECK((frame.reasons & DEFREC_REASON_SATURATED) != 0);
}

TEST_CASE("row 62: a surface without texture is never a template") {
    Session session;
    Pair gray;
    std::fill(gray.left.begin(), gray.left.end(), uint8_t{120});
    gray.right = gray.left;
    const Session::Frame frame = session.track(gray);
    CHECK(frame.state == DEFREC_INITIALISING);
    CHECK((frame.reasons & (DEFREC_REASON_NO_TEXTURE | DEFREC_REASON_NO_DEPTH)) != 0);
    CHECK(frame.vertices.empty());
}

TEST_CASE("row 67: one dark eye is lost, with the eye as the reason") {
    Session session;
    session.track(render(0, 0));
    Pair half = render(0.2, 0);
    std::fill(half.right.begin(), half.right.end(), uint8_t{0});
    const Session::Frame frame = session.track(half);
    CHECK(frame.state == DEFREC_LOST);
    CHECK((frame.reasons & DEFREC_REASON_ONE_EYE) != 0);
}

TEST_CASE("row 6: exchanged eyes are named while there is no template") {
    Session session;
    Pair pair = render(0, 0);
    std::swap(pair.left, pair.right);
    const Session::Frame frame = session.track(pair);
    CHECK(frame.state == DEFREC_INITIALISING);
    CHECK((frame.reasons & DEFREC_REASON_EYES_SWAPPED) != 0);
}

TEST_CASE("row 54: a frozen stream is named, and followed all the same") {
    Session session;
    const Pair pair = render(0, 0);
    CHECK((session.track(pair).reasons & DEFREC_REASON_FROZEN) == 0);
    const Session::Frame again = session.track(pair);
    CHECK((again.reasons & DEFREC_REASON_FROZEN) != 0);
    CHECK(again.state == DEFREC_TRACKING);
}

TEST_CASE("row 51: a gap in the stream is named") {
    Session session;
    for (int i = 0; i < 4; ++i) CHECK((session.track(render(0.1 * i, 0)).reasons & DEFREC_REASON_GAP) == 0);
    session.time += 10 * 33000000;
    CHECK((session.track(render(0.5, 0)).reasons & DEFREC_REASON_GAP) != 0);
}

TEST_CASE("rows 69 and 70: a long static run with noise neither moves nor drifts") {
    Session session;
    session.track(render(0, 0, 2, 1));
    for (uint64_t i = 0; i < 40; ++i) {
        const Session::Frame frame = session.track(render(0, 0, 2, 100 + i));
        CAPTURE(i);
        CHECK(frame.state == DEFREC_TRACKING);
        for (const double shift : frame.shift) CHECK(std::abs(shift) < 0.12);
    }
}

TEST_CASE("row 53: a timestamp that does not grow is refused and changes nothing") {
    Session session;
    session.track(render(0, 0));
    session.time -= 33000000;
    defrec_job job = nullptr;
    CHECK(session.submit(render(0, 0), &job) == DEFREC_ERROR_ARGUMENT);
    CHECK(job == nullptr);
    CHECK(std::string(defrec_last_error()).find("timestamp") != std::string::npos);
    CHECK(session.track(render(0.1, 0)).state == DEFREC_TRACKING);
}

TEST_CASE("a full queue is an error, not a dropped frame; jobs end in order; results stay until released") {
    Session session;
    const Pair pair = render(0, 0);
    defrec_job first = nullptr, second = nullptr, third = nullptr;
    REQUIRE_OK(session.submit(pair, &first));
    REQUIRE_OK(session.submit(render(0.3, 0), &second));
    CHECK(session.submit(pair, &third) == DEFREC_ERROR_BUSY);
    REQUIRE_OK(defrec_job_wait(second, UINT64_MAX));
    CHECK(defrec_job_wait(first, 0) == DEFREC_OK);
    defrec_result one, two;
    DEFREC_INIT(&one);
    DEFREC_INIT(&two);
    REQUIRE_OK(defrec_job_result(first, &one));
    REQUIRE_OK(defrec_job_result(second, &two));
    CHECK(one.frame + 1 == two.frame);
    CHECK(one.vertices != two.vertices);
    defrec_job_release(first);
    REQUIRE_OK(session.submit(pair, &third));
    defrec_job_release(second);
    defrec_job_release(third);
}

TEST_CASE("row 29: destroying a tracker with frames queued ends them, and their jobs stay valid") {
    Session session;
    defrec_job first = nullptr, second = nullptr;
    REQUIRE_OK(session.submit(render(0, 0), &first));
    REQUIRE_OK(session.submit(render(0.1, 0), &second));
    defrec_tracker_destroy(session.tracker);
    session.tracker = nullptr;
    for (defrec_job job : {first, second}) {
        const defrec_status status = defrec_job_wait(job, UINT64_MAX);
        CHECK((status == DEFREC_OK || status == DEFREC_ERROR_STATE));
        defrec_job_release(job);
    }
}

TEST_CASE("a template can be saved, loaded and tracked by another tracker") {
    const std::filesystem::path path = std::filesystem::temp_directory_path() / "defrec_tracker_test_template";
    {
        Session session;
        session.track(render(0, 0));
        defrec_template surface = nullptr;
        REQUIRE_OK(defrec_tracker_get_template(session.tracker, &surface));
        REQUIRE_OK(defrec_template_save(surface, path.c_str()));
        defrec_template_release(surface);
    }
    Session session;
    defrec_template surface = nullptr;
    CHECK(defrec_tracker_get_template(session.tracker, &surface) == DEFREC_ERROR_STATE);
    REQUIRE_OK(defrec_template_load(session.context, path.c_str(), &surface));
    REQUIRE_OK(defrec_tracker_set_template(session.tracker, surface));
    defrec_template_release(surface);
    const Session::Frame frame = session.track(render(2, 1));
    CHECK(frame.state == DEFREC_RELOCALISED);
    CHECK(std::abs(frame.shift[0] - 2) < 0.2);
    std::filesystem::remove(path);
}

TEST_CASE("a template is captured anew on request") {
    Session session;
    const uint32_t epoch = session.track(render(0, 0)).epoch;
    session.track(render(3, 0));
    const Session::Frame frame = session.track(render(3, 0, 1, 3), nullptr, DEFREC_FRAME_CAPTURE_TEMPLATE);
    CHECK(frame.epoch == epoch + 1);
    CHECK(std::abs(frame.shift[0]) < 0.15);
}

TEST_CASE("ignored pixels give no features and no patches") {
    Session whole, half;
    std::vector<uint8_t> ignore(kWidth * kHeight);
    for (size_t y = 0; y < kHeight; ++y)
        for (size_t x = kWidth / 2; x < kWidth; ++x) ignore[y * kWidth + x] = 1;
    const Session::Frame all = whole.track(render(0, 0)), left = half.track(render(0, 0), &ignore);
    CHECK(left.features < all.features);
    CHECK(left.patches < 0.7 * all.patches);
    CHECK(left.patches > 0);
}

TEST_CASE("two runs, and one or three threads, give the same bits") {
    Session a("cpu", 1), b("cpu", 3), c("cpu", 3);
    for (int i = 0; i < 4; ++i) {
        const Pair pair = render(0.6 * i, 0.2 * i, 2, static_cast<uint64_t>(i));
        const Session::Frame one = a.track(pair), two = b.track(pair), three = c.track(pair);
        CHECK(one.vertices == two.vertices);
        CHECK(two.vertices == three.vertices);
        CHECK(one.status == two.status);
    }
}

TEST_CASE("the reference backend follows the same surface to the same place") {
    Session cpu("cpu"), reference("reference");
    for (int i = 0; i < 2; ++i) {
        const Pair pair = render(1.5 * i, 0);
        const Session::Frame fast = cpu.track(pair), plain = reference.track(pair);
        CHECK(plain.state == fast.state);
        for (int axis = 0; axis < 3; ++axis) CHECK(std::abs(fast.shift[axis] - plain.shift[axis]) < 0.02);
    }
}
