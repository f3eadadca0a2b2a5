// Disparity that the application gives with a frame: it does what the same of stage stereo does,
// its stated error is in the expected errors, and one that is not of the images is told.
#include <doctest/doctest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec::test;

namespace {

constexpr size_t kPixels = size_t{kWidth} * kHeight;
// Stage stereo's own, the root of b1 in docs/tracker/states.md.
const float kStageSigma = std::sqrt(0.0009f);

using Disparity = std::vector<float>;

Disparity disparity_of(const std::function<double(int, int)>& at) {
    Disparity made(kPixels);
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x)
            made[static_cast<size_t>(y * kWidth + x)] = static_cast<float>(at(x, y));
    return made;
}
// The plane's, px.
double true_disparity(int x) {
    const double z = kDepth / (1 - kSlope * (x - kWidth / 2) / kFocal);
    return kFocal * kBaseline / z;
}
Disparity true_disparity() {
    return disparity_of([](int x, int) { return true_disparity(x); });
}

defrec_disparity desc_of(const Disparity& disparity, float sigma_px) {
    defrec_disparity desc;
    DEFREC_INIT(&desc);
    desc.width = kWidth;
    desc.height = kHeight;
    desc.disparity = disparity.data();
    desc.sigma_px = sigma_px;
    return desc;
}

class Session {
  public:
    explicit Session(const char* device = "cpu", const TrackingSession::Change& change = nullptr)
        : session_(
              device, 2,
              [&](defrec_rig_desc& rig, defrec_tracker_desc& tracker) {
                  tracker.keep_disparity = 1;
                  tracker.body = DEFREC_BODY_OFF;
                  if (change) change(rig, tracker);
              },
              [&](defrec_context_desc& desc) {
                  if (std::string(device) != "asynchronous") return;  // one context at a time
                  static const std::string asynchronous =
                      std::string(DEFREC_BUILD_DIR) + "/test_plugins/asynchronous";
                  static const char* const paths[] = {asynchronous.c_str()};
                  desc.plugin_paths = paths;
                  desc.plugin_path_count = 1;
              }) {}

    using Given = const defrec_disparity*;
    using Change = std::function<void(defrec_frame&)>;
    defrec_status submit(double moved, Given given, defrec_job* job,
                         const std::vector<uint8_t>& ignore = {}, const Change& change = nullptr) {
        const Pair pair = render(moved, moved / 2, 1, static_cast<uint64_t>(8 * moved));
        return session_.submit(
            {{pair.left.data()}, {pair.right.data()}, {ignore.empty() ? nullptr : ignore.data()}},
            job, [&](defrec_frame& frame) {
                frame.disparity = given;
                if (change) change(frame);
            });
    }
    // Done, to be released.
    defrec_job track(double moved, Given given, const std::vector<uint8_t>& ignore = {}) {
        defrec_job job = nullptr;
        REQUIRE_OK(submit(moved, given, &job, ignore));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        return job;
    }
    defrec_job track_within(uint64_t deadline_ns, double moved, Given given, uint32_t flags) {
        defrec_job job = nullptr;
        REQUIRE_OK(submit(moved, given, &job, {}, [&](defrec_frame& frame) {
            frame.deadline_ns = deadline_ns;
            frame.flags = flags;
        }));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        return job;
    }
    defrec_tracker tracker() const { return session_.tracker; }
    defrec_context context() const { return session_.context; }
    defrec_rig rig() const { return session_.rig; }

  private:
    TrackingSession session_;
};

// The results of a frame that are compared.
struct Frame {
    uint32_t state = 0, reasons = 0;
    float observed_share = 0;
    std::vector<float> vertices, covariance, errors;
    std::vector<uint8_t> status, evidence;
    std::vector<int16_t> disparity;
    std::string rest;  // of what a result holds, but for covariances

    explicit Frame(defrec_job job) {
        defrec_result r;
        DEFREC_INIT(&r);
        REQUIRE_OK(defrec_job_result(job, &r));
        state = r.state;
        reasons = r.reasons;
        observed_share = r.observed_share;
        vertices.assign(r.vertices, r.vertices + 3 * r.vertex_count);
        covariance.assign(r.vertex_covariance, r.vertex_covariance + 6 * r.vertex_count);
        errors.assign(r.expected_error_mm, r.expected_error_mm + r.vertex_count);
        status.assign(r.vertex_status, r.vertex_status + r.vertex_count);
        evidence.assign(r.vertex_evidence, r.vertex_evidence + r.vertex_count);
        disparity.assign(r.disparity, r.disparity + kPixels);
        const auto add = [&](const auto* from, uint64_t count) {
            rest.append(reinterpret_cast<const char*>(from), count * sizeof *from);
        };
        add(r.motions, r.node_count);
        add(r.normals, 3 * r.vertex_count);
        add(r.landmark_matches, r.landmark_count);
        add(r.patch_observations, r.patch_count);
        defrec_job_release(job);
    }
    bool tracked() const { return state == DEFREC_TRACKING || state == DEFREC_RELOCALISED; }
};

Disparity as_given(const std::vector<int16_t>& of_stage) {
    Disparity made;
    for (const int16_t value : of_stage)
        made.push_back(value == DEFREC_DISPARITY_NONE
                           ? 0
                           : static_cast<float>(value) / float{DEFREC_DISPARITY_ONE});
    return made;
}

void check_same(const Frame& given, const Frame& measured) {
    CHECK(given.state == measured.state);
    CHECK(given.reasons == measured.reasons);
    CHECK(given.vertices == measured.vertices);
    CHECK(given.status == measured.status);
    CHECK(given.evidence == measured.evidence);
    CHECK(given.disparity == measured.disparity);
    CHECK(given.rest == measured.rest);
    REQUIRE(given.errors.size() == measured.errors.size());
    for (size_t i = 0; i < given.errors.size(); ++i)
        REQUIRE(given.errors[i] == doctest::Approx(measured.errors[i]).epsilon(1e-4));
}

constexpr double kSteps[] = {0, 0.4, 0.9, 1.3, 1.1, 0.6};

// Frames of kSteps with the disparity that stage stereo measures. One context at a time: device
// "asynchronous" bears no other.
std::vector<Frame> measured_frames(const char* device) {
    Session session(device);
    std::vector<Frame> frames;
    for (const double moved : kSteps) frames.emplace_back(session.track(moved, nullptr));
    return frames;
}

void check_as_stage(const char* device, bool gives_every_frame) {
    CAPTURE(std::string(device));
    const std::vector<Frame> measured = measured_frames(device);
    Session given(device);
    for (size_t i = 0; i < std::size(kSteps); ++i) {
        CAPTURE(i);
        CHECK(measured[i].tracked());
        const Disparity disparity = as_given(measured[i].disparity);
        const defrec_disparity desc = desc_of(disparity, kStageSigma);
        const bool is_given = gives_every_frame || i % 2 == 1;
        check_same(Frame(given.track(kSteps[i], is_given ? &desc : nullptr)), measured[i]);
    }
}

}  // namespace

TEST_CASE("disparity of stage stereo gives what the stage gives, on each kind of device") {
    for (const char* device : {"cpu", "reference", "asynchronous"}) check_as_stage(device, true);
}

TEST_CASE("a frame without disparity has that of stage stereo, between frames that have some") {
    check_as_stage("cpu", false);
}

TEST_CASE("frames that are given with several under way keep their own disparity") {
    const std::vector<Frame> measured = measured_frames("asynchronous");
    Session given("asynchronous");
    defrec_job before = nullptr;
    size_t compared = 0;
    for (size_t i = 0; i < std::size(kSteps); ++i) {
        defrec_job job = nullptr;
        {
            // It is copied before the call returns.
            Disparity disparity = as_given(measured[i].disparity);
            const defrec_disparity desc = desc_of(disparity, kStageSigma);
            REQUIRE_OK(given.submit(kSteps[i], &desc, &job));
            std::fill(disparity.begin(), disparity.end(), 1.0f);
        }
        if (before != nullptr) {
            REQUIRE_OK(defrec_job_wait(before, UINT64_MAX));
            check_same(Frame(before), measured[i - 1]);
            ++compared;
        }
        before = job;
    }
    REQUIRE_OK(defrec_job_wait(before, UINT64_MAX));
    check_same(Frame(before), measured.back());
    CHECK(compared == std::size(kSteps) - 1);
}

TEST_CASE("the stated error is in the expected errors, along the ray, at the pixels that have it") {
    constexpr float kLeft = 0.1f, kRight = 0.6f;
    const Disparity disparity = true_disparity();
    const Disparity sigma =
        disparity_of([](int x, int) { return x < kWidth / 2 ? kLeft : kRight; });
    const defrec_disparity fine = desc_of(disparity, kStageSigma);
    defrec_disparity coarse = desc_of(disparity, 0);
    coarse.sigma = sigma.data();
    Session one, other;
    one.track(0, &fine);
    Frame(other.track(0, &coarse));
    const Frame with_fine(one.track(0.4, &fine)), with_coarse(other.track(0.4, &coarse));
    CHECK(with_fine.tracked());
    CHECK(with_coarse.tracked());
    REQUIRE(with_fine.errors.size() == with_coarse.errors.size());
    CHECK(with_fine.vertices == with_coarse.vertices);
    size_t compared = 0;
    for (size_t i = 0; i < with_fine.errors.size(); ++i) {
        const float* p = &with_fine.vertices[3 * i];
        const double column = kFocal * p[0] / p[2] + kWidth / 2,
                     row = kFocal * p[1] / p[2] + kHeight / 2;
        if (column < 2 || row < 2 || column > kWidth - 3 || row > kHeight - 3 ||
            std::abs(column - kWidth / 2) < 2)
            continue;
        const double stated = column < kWidth / 2 ? kLeft : kRight,
                     mm = p[2] * p[2] / (kFocal * kBaseline),
                     more = mm * mm * (stated * stated - kStageSigma * kStageSigma);
        // zz is that along the ray.
        CHECK(with_coarse.covariance[6 * i + 5] - with_fine.covariance[6 * i + 5] ==
              doctest::Approx(more).epsilon(2e-3));
        ++compared;
    }
    CHECK(compared > 300);
}

TEST_CASE("errors of a true disparity with the stated noise lie within the expected ones") {
    constexpr double kSigma = 0.4;
    Session session;
    size_t within[3] = {}, all = 0;
    for (int k = 0; k < 24; ++k) {
        // The same at all pixels of a frame: what neighbours share.
        const double shared = kSigma * std::sqrt(12.0) * hash_noise(k, 0, 3);
        const Disparity disparity = disparity_of([&](int x, int y) {
            return true_disparity(x) + shared + 0.5 * hash_noise(x, y, static_cast<uint64_t>(k));
        });
        const defrec_disparity desc = desc_of(disparity, static_cast<float>(kSigma));
        const Frame frame(session.track(k * 0.05, &desc));
        REQUIRE(frame.tracked());
        for (size_t i = 0; i < frame.errors.size(); ++i) {
            if (frame.status[i] != DEFREC_POINT_OBSERVED) continue;
            const float* p = &frame.vertices[3 * i];
            const double off = std::abs(p[2] - kDepth - kSlope * p[0]);
            for (int times = 0; times < 3; ++times)
                within[times] += off <= (times + 1) * frame.errors[i];
            ++all;
        }
    }
    REQUIRE(all > 5000);
    const auto share = [&](size_t count) {
        return static_cast<double>(count) / static_cast<double>(all);
    };
    MESSAGE("within one, two, three expected errors: ", share(within[0]), ", ", share(within[1]),
            ", ", share(within[2]));
    CHECK(share(within[0]) > 0.5);
    CHECK(share(within[1]) > 0.93);
    CHECK(share(within[2]) > 0.985);
}

TEST_CASE("row 201: disparity that is not of the images makes no template, and says why") {
    const Disparity half = disparity_of([](int x, int) { return true_disparity(x) / 2; }),
                    shifted = disparity_of([](int x, int) { return true_disparity(x) + 4; }),
                    depth = disparity_of([](int x, int) {
                        return kFocal * kBaseline / true_disparity(x);  // mm
                    });
    for (const Disparity* wrong : {&half, &shifted, &depth}) {
        Session session;
        const defrec_disparity desc = desc_of(*wrong, 0.3f);
        const defrec_job job = session.track(0, &desc);
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        CHECK(result.state == DEFREC_INITIALISING);
        CHECK((result.reasons & DEFREC_REASON_DISPARITY) != 0);
        CHECK((result.reasons & DEFREC_REASON_LOW_CONTRAST) == 0);
        defrec_job_release(job);
        // The next frame makes one.
        const Disparity right = true_disparity();
        const defrec_disparity good = desc_of(right, 0.3f);
        const Frame next(session.track(0.2, &good));
        CHECK(next.tracked());
        CHECK((next.reasons & DEFREC_REASON_DISPARITY) == 0);
    }
}

TEST_CASE("row 201: a disparity that shows no surface, or leads away from it, is told") {
    const auto of = [](const std::function<double(double)>& made) {
        return disparity_of([&](int x, int) { return made(true_disparity(x)); });
    };
    const Disparity good = true_disparity(), share = of([](double d) { return d / kWidth; }),
                    metres = of([](double d) { return kFocal * kBaseline / d / 1000; }),
                    half = of([](double d) { return d / 2; }),
                    larger = of([](double d) { return 4 * d; });
    const defrec_disparity right = desc_of(good, 0.3f);
    for (const Disparity* wrong : {&share, &metres, &half, &larger}) {
        const defrec_disparity bad = desc_of(*wrong, 0.3f);
        Session first;
        const Frame none(first.track(0, &bad));
        CHECK(none.state == DEFREC_INITIALISING);
        CHECK((none.reasons & DEFREC_REASON_DISPARITY) != 0);
        Session session;
        Frame(session.track(0, &right));
        const Frame lost(session.track(0.2, &bad));
        CHECK(lost.state != DEFREC_TRACKING);
        CHECK((lost.reasons & DEFREC_REASON_DISPARITY) != 0);
        const Frame after(session.track(0.3, &right));
        CHECK(after.tracked());
        CHECK((after.reasons & DEFREC_REASON_DISPARITY) == 0);
    }
}

TEST_CASE("a frame that is given no disparity at any pixel is followed by the left image") {
    const Disparity good = true_disparity(), none(kPixels, 0);
    const defrec_disparity right = desc_of(good, 0.3f), empty = desc_of(none, 0.3f);
    for (const char* device : {"cpu", "asynchronous"}) {
        Session session(device);
        Frame(session.track(0, &right));
        Frame(session.track(0.2, &right));
        const Frame without(session.track(0.4, &empty));
        CHECK(without.state == DEFREC_DEGRADED);
        CHECK((without.reasons & DEFREC_REASON_NO_DEPTH) != 0);
        CHECK((without.reasons & DEFREC_REASON_DISPARITY) == 0);
        CHECK(Frame(session.track(0.5, &right)).state == DEFREC_TRACKING);
    }
    Session first;
    const Frame frame(first.track(0, &empty));
    CHECK(frame.state == DEFREC_INITIALISING);
    CHECK(frame.reasons == DEFREC_REASON_NO_DEPTH);
}

TEST_CASE("a template of more disparity than the image is wide is saved, loaded and followed") {
    Session session;
    // Where the images do not contradict it: at less than half of the pixels.
    const Disparity far_off =
        disparity_of([](int x, int) { return true_disparity(x) + (x > 0.7 * kWidth ? 1700 : 0); });
    const defrec_disparity desc = desc_of(far_off, 0.3f);
    CHECK(Frame(session.track(0, &desc)).tracked());
    defrec_template surface = nullptr;
    REQUIRE_OK(defrec_tracker_get_template(session.tracker(), &surface));
    const TemporaryFolder folder;
    const std::string path = (folder.path() / "near.template").string();
    REQUIRE_OK(defrec_template_save(surface, path.c_str()));
    defrec_template_release(surface);
    CHECK(defrec_template_load(session.context(), path.c_str(), &surface) == DEFREC_OK);
    defrec_template_release(surface);
}

TEST_CASE("row 201: what the right view does not show where the disparity says is no agreement") {
    for (const double off : {25.0, 40.0, 100.0}) {
        CAPTURE(off);
        const Disparity wrong = disparity_of(
            [&](int x, int) { return true_disparity(x) + (x >= 0.4 * kWidth ? off : 0); });
        const defrec_disparity bad = desc_of(wrong, 0.3f);
        Session session;
        const Frame frame(session.track(0, &bad));
        CHECK(frame.state == DEFREC_INITIALISING);
        CHECK((frame.reasons & DEFREC_REASON_DISPARITY) != 0);
    }
}

TEST_CASE("row 201: a deadline does not keep a template's disparity from being compared") {
    const Disparity right = true_disparity(),
                    wrong = disparity_of([](int x, int) { return true_disparity(x) + 6; });
    const defrec_disparity good = desc_of(right, 0.3f), bad = desc_of(wrong, 0.3f);
    constexpr uint64_t kShort = 1;  // ns
    // The first frame, of whose time nothing is known, and one that is to be captured anew.
    for (const bool is_first : {true, false}) {
        CAPTURE(is_first);
        Session session;
        if (!is_first)
            for (const double moved : {0.0, 0.2}) Frame(session.track(moved, &good));
        const uint32_t flags = is_first ? 0 : DEFREC_FRAME_CAPTURE_TEMPLATE;
        const Frame frame(session.track_within(kShort, 0.3, &bad, flags));
        CHECK(frame.state == DEFREC_INITIALISING);
        CHECK((frame.reasons & DEFREC_REASON_DISPARITY) != 0);
        const Frame next(session.track_within(kShort, 0.4, &good, flags));
        CHECK(next.state != DEFREC_INITIALISING);
        CHECK((next.reasons & (DEFREC_REASON_DISPARITY | DEFREC_REASON_UNCHECKED)) == 0);
    }
}

TEST_CASE("row 201: a frame whose disparity is not of its images is degraded, its errors grow") {
    for (const double off : {3.0, -3.0, 8.0}) {
        CAPTURE(off);
        Session session;
        const Disparity right = true_disparity(),
                        wrong = disparity_of([&](int x, int) { return true_disparity(x) + off; });
        const defrec_disparity good = desc_of(right, kStageSigma),
                               bad = desc_of(wrong, kStageSigma);
        const Frame first(session.track(0, &good)), before(session.track(0.2, &good)),
            frame(session.track(0.4, &bad)), after(session.track(0.5, &good));
        CHECK(first.tracked());
        CHECK(before.tracked());
        CAPTURE(frame.reasons);
        CAPTURE(frame.state);
        CAPTURE(frame.observed_share);
        CHECK(frame.state != DEFREC_TRACKING);
        if (frame.state == DEFREC_DEGRADED) {
            CHECK((frame.reasons & DEFREC_REASON_DISPARITY) != 0);
            CHECK((frame.reasons & DEFREC_REASON_CALIBRATION) == 0);
            CHECK(frame.observed_share == 0);
            size_t within = 0;
            for (size_t i = 0; i < frame.errors.size(); ++i) {
                const float* p = &frame.vertices[3 * i];
                within += std::abs(p[2] - kDepth - kSlope * p[0]) <= 2 * frame.errors[i];
            }
            CHECK(static_cast<double>(within) >= 0.93 * static_cast<double>(frame.errors.size()));
        }
        CHECK(after.tracked());
        CHECK((after.reasons & DEFREC_REASON_DISPARITY) == 0);
    }
}

TEST_CASE("disparity is not used of pixels that the frame ignores") {
    const Disparity disparity = true_disparity();
    const defrec_disparity desc = desc_of(disparity, 0.1f);
    std::vector<uint8_t> ignore(kPixels, 0);
    for (int y = 100; y < 140; ++y)
        for (int x = 100; x < 160; ++x) ignore[static_cast<size_t>(y * kWidth + x)] = 255;
    Session session;
    const Frame frame(session.track(0, &desc, ignore));
    CHECK(frame.tracked());
    for (size_t i = 0; i < kPixels; ++i)
        REQUIRE((frame.disparity[i] == DEFREC_DISPARITY_NONE) == (ignore[i] != 0));
}

TEST_CASE("an ignored pixel of the raw image hides what it becomes in the rectified one") {
    const Disparity disparity = true_disparity();
    const defrec_disparity desc = desc_of(disparity, 0.1f);
    constexpr int kFrom = 100, kTo = 160, kBottom = 140;
    std::vector<uint8_t> ignore(kPixels, 0);
    for (int y = kFrom; y < kBottom; ++y)
        for (int x = kFrom; x < kTo; ++x) ignore[static_cast<size_t>(y * kWidth + x)] = 1;
    Session session("cpu", [](defrec_rig_desc& rig, defrec_tracker_desc&) {
        for (defrec_intrinsics* view : {&rig.left, &rig.right}) {
            view->distortion[0] = -0.2;
            view->distortion_count = 4;
        }
    });
    const Frame frame(session.track(0, &desc, ignore));
    std::vector<double> uv;
    for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) uv.insert(uv.end(), {double(x), double(y)});
    REQUIRE_OK(defrec_rig_distort_pixels(session.rig(), uv.data(), kPixels, uv.data()));
    size_t inside = 0, outside = 0;
    for (size_t i = 0; i < kPixels; ++i) {
        const double u = uv[2 * i], v = uv[2 * i + 1];
        const bool is_none = frame.disparity[i] == DEFREC_DISPARITY_NONE;
        // One of the four pixels round the place is ignored.
        if (u > kFrom && v > kFrom && u < kTo - 1 && v < kBottom - 1) {
            REQUIRE(is_none);
            ++inside;
        } else if (u < kFrom - 1.1 || v < kFrom - 1.1 || u > kTo + 0.1 || v > kBottom + 0.1) {
            REQUIRE_FALSE(is_none);
            ++outside;
        }
    }
    CHECK(inside > 1500);
    CHECK(outside > kPixels / 2);
}

TEST_CASE("a registration to a template counts with the stated error of its disparity") {
    // The plane that the template shows, as a model.
    std::vector<float> vertices;
    for (const double y : {-60.0, 60.0})
        for (const double x : {-80.0, 80.0})
            for (const double value : {x, y, kDepth + kSlope * x})
                vertices.push_back(static_cast<float>(value));
    const uint32_t triangles[] = {0, 2, 1, 1, 2, 3};
    const Disparity disparity = true_disparity();
    const auto depth_variance = [&](float sigma_px) {
        const defrec_disparity desc = desc_of(disparity, sigma_px);
        Session session;
        defrec_job_release(session.track(0, &desc));
        defrec_template surface = nullptr;
        REQUIRE_OK(defrec_tracker_get_template(session.tracker(), &surface));
        // Through a file, which keeps it.
        const TemporaryFolder folder;
        const std::string path = (folder.path() / "plane.template").string();
        REQUIRE_OK(defrec_template_save(surface, path.c_str()));
        defrec_template_release(surface);
        REQUIRE_OK(defrec_template_load(session.context(), path.c_str(), &surface));
        defrec_registration_desc model;
        DEFREC_INIT(&model);
        model.model_vertices = vertices.data();
        model.model_vertex_count = vertices.size() / 3;
        model.model_triangles = triangles;
        model.model_triangle_count = 2;
        defrec_registration registration = nullptr;
        REQUIRE_OK(
            defrec_registration_from_template(session.context(), surface, &model, &registration));
        // Across the plane; along it nothing tells where it lies.
        const double place[3] = {0, 0, kDepth};
        double xyz[3], c[6];
        REQUIRE_OK(defrec_registration_move_points(registration, place, 1, xyz, c, nullptr));
        const double variance =
            (kSlope * kSlope * c[0] - 2 * kSlope * c[2] + c[5]) / (1 + kSlope * kSlope);
        defrec_registration_destroy(registration);
        defrec_template_release(surface);
        return variance;
    };
    const double fine = depth_variance(0.05f), coarse = depth_variance(0.5f);
    CHECK(fine > 0);
    CHECK(coarse > 5 * fine);
}

TEST_CASE("row 200: disparity that none can be is refused with its pixel, and no frame is lost") {
    Session session;
    const Disparity good = true_disparity();
    const auto refused = [&](const std::function<void(defrec_disparity&, Disparity&)>& spoil,
                             const std::string& words) {
        Disparity values = good;
        defrec_disparity desc = desc_of(values, 0.1f);
        spoil(desc, values);
        defrec_job job = nullptr;
        CHECK(session.submit(0, &desc, &job) == DEFREC_ERROR_ARGUMENT);
        CHECK(job == nullptr);
        CHECK_MESSAGE(std::string(defrec_last_error()).find(words) != std::string::npos,
                      defrec_last_error());
    };
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                    kInfinity = std::numeric_limits<float>::infinity();
    constexpr size_t kAt = 7 * kWidth + 30;
    for (const float wrong : {kNan, kInfinity, -kInfinity, -0.5f, -16.0f, 2000.5f, 1e30f}) {
        CAPTURE(wrong);
        refused([&](defrec_disparity&, Disparity& values) { values[kAt] = wrong; },
                "pixel (30, 7)");
    }
    refused([](defrec_disparity& desc, Disparity&) { desc.width = kWidth / 2; }, "160 x 240");
    refused([](defrec_disparity& desc, Disparity&) { desc.height += 1; }, "320 x 241");
    refused([](defrec_disparity& desc, Disparity&) { desc.disparity = nullptr; },
            "disparity.disparity is NULL");
    refused([](defrec_disparity& desc, Disparity&) { desc.stride = kWidth; }, "stride");
    refused([](defrec_disparity& desc, Disparity&) { desc.stride = 4 * kWidth + 2; }, "stride");
    refused([](defrec_disparity& desc, Disparity&) { desc.stride = UINT64_MAX - 3; }, "stride");
    refused([](defrec_disparity& desc, Disparity&) { desc.flags = 1; }, "flags");
    refused([](defrec_disparity& desc, Disparity&) { desc.reserved = 7; },
            "disparity.reserved is 7, 0 expected");
    refused([](defrec_disparity& desc,
               Disparity&) { desc.disparity = reinterpret_cast<const float*>(UINTPTR_MAX - 15); },
            "address");
    // An error has to be stated, and nobody has none.
    for (const float wrong : {0.0f, -1.0f, kNan, kInfinity, 101.0f, 0.0001f}) {
        CAPTURE(wrong);
        refused([&](defrec_disparity& desc, Disparity&) { desc.sigma_px = wrong; }, "sigma_px");
        std::vector<float> sigma(kPixels, 0.2f);
        sigma[kAt] = wrong;
        refused(
            [&](defrec_disparity& desc, Disparity&) {
                desc.sigma_px = 0;
                desc.sigma = sigma.data();
            },
            "sigma of pixel (30, 7)");
    }
    const std::vector<float> sigma(kPixels, 0.2f);
    refused([&](defrec_disparity& desc, Disparity&) { desc.sigma = sigma.data(); },
            "one of both expected");
    defrec_disparity short_size = desc_of(good, 0.1f);
    short_size.struct_size = 0;
    defrec_job job = nullptr;
    CHECK(session.submit(0, &short_size, &job) == DEFREC_ERROR_VERSION);

    // The tracker goes on, and takes rows that are apart.
    constexpr size_t kRow = kWidth + 24;
    std::vector<float> apart(kRow * kHeight, kNan), deviations(kRow * kHeight, kNan);
    for (size_t y = 0; y < kHeight; ++y)
        for (size_t x = 0; x < kWidth; ++x) {
            apart[y * kRow + x] = (x + y) % 97 == 0 ? 0 : good[y * kWidth + x];
            // Nobody looks at the error of a pixel without disparity.
            if (apart[y * kRow + x] != 0) deviations[y * kRow + x] = 0.2f;
        }
    defrec_disparity desc = desc_of(apart, 0);
    desc.stride = kRow * sizeof(float);
    desc.sigma = deviations.data();
    const Frame frame(session.track(0, &desc));
    CHECK(frame.tracked());
    for (size_t i = 0; i < kPixels; ++i) {
        const bool is_none = (i / kWidth + i % kWidth) % 97 == 0;
        REQUIRE((frame.disparity[i] == DEFREC_DISPARITY_NONE) == is_none);
        if (!is_none) REQUIRE(frame.disparity[i] == static_cast<int16_t>(16 * good[i] + 0.5f));
    }
}
