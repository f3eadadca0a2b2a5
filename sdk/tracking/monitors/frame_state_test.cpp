// What evidence means: states, reasons, and confidence in vertices.
#include "sdk/tracking/monitors/frame_state.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "backends/shared/motion.hpp"
#include "sdk/base/os/services.hpp"
#include "sdk/template/decisions.hpp"
#include "sdk/tracking/decisions/confidence.hpp"
#include "sdk/tracking/evidence/vertex_confidence.hpp"

namespace {

using namespace defrec;

// A flat template of 11x9 vertices at 80 mm with one control point and a patch at every vertex, and
// a frame that saw all of it.
struct Fixture {
    TemplateData data;
    std::vector<defrec_motion> motions;
    std::vector<defrec_surface_sample> samples;
    std::vector<defrec_patch_observation> observations;
    std::vector<defrec_patch_prediction> predictions;
    std::vector<defrec_patch_observation> checks;
    std::vector<float> contradicted_mm;  // by the frames before
    FrameSummary summary;
    FrameOutput output;  // of the arrays above

    explicit Fixture(int columns = 11, int rows = 9) {
        data.width = 200;
        data.height = 160;
        data.camera = {200, 200, 100, 80, 5, 0};
        data.grid.columns = columns;
        data.grid.rows = rows;
        data.grid.spacing = 20;
        for (int y = 0; y < data.grid.rows; ++y)
            for (int x = 0; x < data.grid.columns; ++x) {
                data.grid.vertex.push_back(static_cast<int32_t>(data.vertices.size()));
                const auto p = back_project(data.camera, 20.0 * x, 20.0 * y, 200 * 5 / 80.0);
                defrec_surface_point point{};
                defrec_patch patch{};
                for (int axis = 0; axis < 3; ++axis)
                    patch.position[axis] = point.position[axis] =
                        static_cast<float>(p[static_cast<size_t>(axis)]);
                point.normal[2] = -1;
                point.weight[0] = patch.weight[0] = 1;
                data.vertices.push_back(point);
                data.vertex_support.push_back(0);
                data.patches.push_back(patch);
                defrec_surface_sample sample{};
                std::copy(std::begin(point.position), std::end(point.position), sample.position);
                samples.push_back(sample);
                predictions.push_back({5120 * x, 5120 * y, {}, 1, 0});
                observations.push_back({5120 * x, 5120 * y, 4000, 1, {1, 0, 1}, 0});
                data.checks.push_back(patch);
                data.check_of_vertex.push_back(static_cast<int32_t>(checks.size()));
                checks.push_back(observations.back());
            }
        data.nodes = {0, 0, 80};
        motions.push_back(DualQuaternion<float>::identity().store());
        summary.ransac.valid_matches = 60;
        summary.ransac.inliers = 40;
        output.summary = &summary;
        output.motions = motions;
        output.samples = samples;
        output.observations = observations;
        output.predictions = predictions;
        output.checks = checks;
        output.check_predictions = predictions;
    }
    Fixture(const Fixture&) = delete;
    Fixture& operator=(const Fixture&) = delete;
    std::vector<double> patch_px2() const {
        std::vector<double> squares(data.patches.size());
        measure_patches(data, output, 0, squares);
        return squares;
    }
    Evidence evidence() const {
        const VertexEvidence vertices = weigh_vertices(output.samples);
        return weigh_evidence(output, {&vertices, 1}, patch_px2());
    }
    TrackerSettings settings = with_defaults({});
    FrameQuality quality(bool was_found = true) {
        return classify(data, evidence(), settings, was_found);
    }
    VertexConfidence confidence(const RigEstimate& rig = {}, SurfaceSamples last = {},
                                bool uses_depth = true, const Services* helpers = nullptr) {
        const SurfaceModel model(data);
        PhotometricEvidence photometric;
        photometric.make_room(data);
        spread_patches(data, patch_px2(), photometric);
        spread_checks(data, model.checked, output, photometric);
        measure_photometric(data, output, 0, output.samples.size(), photometric);
        VertexConfidence result;
        const auto mean_residual = static_cast<float>(evidence().mean_residual_mm);
        begin_confidence(model, result);
        FrameEvidence of_frame{output, photometric, mean_residual, rig, last, uses_depth};
        of_frame.contradicted_mm = contradicted_mm;
        estimate_confidence(
            model, of_frame, helpers, [] {}, result);
        return result;
    }
};

constexpr size_t kMiddle = 4 * 11 + 5;  // the vertex on the optical axis

}  // namespace

TEST_CASE("a surface seen whole is found, without reasons") {
    Fixture f;
    const Evidence evidence = f.evidence();
    CHECK(evidence.observed_share() == 1);
    CHECK(evidence.patches_confirmed == f.data.patches.size());
    CHECK(evidence.patch_rms_px < 1e-3);
    CHECK(f.quality().found);
    CHECK_FALSE(f.quality().degraded);
    CHECK(f.quality().reasons == 0);
}

TEST_CASE("confidence is the same to the last bit whatever threads take part") {
    Fixture f(91, 61);  // of which no part is whole vectors
    for (size_t i = 0; i < f.samples.size(); ++i) {
        f.samples[i].residual = static_cast<float>(i % 7) / 10;
        f.checks[i].valid = i % 3 != 0;
        if (i % 11 < 4) f.samples[i].observation = DEFREC_OCCLUDED;
        f.observations[i].u += static_cast<int32_t>(i % 5) * 40;
    }
    f.samples.front().observation = DEFREC_NO_DEPTH;
    const VertexConfidence alone = f.confidence();
    defrec_context_desc desc{};
    desc.threads = 4;
    const Services services(desc);
    const VertexConfidence together = f.confidence({}, {}, true, &services);
    CHECK(alone.status == together.status);
    CHECK(alone.evidence == together.evidence);
    CHECK(alone.expected_error == together.expected_error);
    CHECK(alone.covariance == together.covariance);
    CHECK(std::count(alone.status.begin(), alone.status.end(), DEFREC_POINT_OBSERVED) > 100);
    CHECK(std::count(alone.status.begin(), alone.status.end(), DEFREC_POINT_EXTRAPOLATED) > 100);
}

TEST_CASE("patches found elsewhere than the surface has them confirm nothing") {
    Fixture f;
    for (defrec_patch_observation& observation : f.output.observations) observation.u += 5 * 256;
    CHECK(f.evidence().patches_confirmed == 0);
    CHECK_FALSE(f.quality().found);
}

TEST_CASE(
    "row 60: in smoke a surface that was followed is kept on little evidence; to be found again it "
    "needs more") {
    Fixture f;
    for (size_t i = 0; i < f.output.observations.size(); ++i)
        if (i % 11 > 3) f.output.observations[i].valid = 0;
    f.summary.ransac.inliers = 0;
    CHECK(f.quality(true).found);
    CHECK(f.quality(true).degraded);
    CHECK((f.quality(true).reasons & DEFREC_REASON_LOW_CONTRAST) != 0);
    CHECK_FALSE(f.quality(false).found);
}

TEST_CASE("an image rich in features that shows the surface nowhere is neither smoke nor blur") {
    Fixture f;
    f.data.landmarks.resize(100);
    for (defrec_patch_observation& observation : f.output.observations) observation.valid = 0;
    f.summary.ransac.inliers = 0;
    f.summary.features = 49;
    CHECK_FALSE(f.quality().found);
    CHECK((f.quality().reasons & DEFREC_REASON_LOW_CONTRAST) != 0);
    f.summary.features = 50;
    CHECK_FALSE(f.quality().found);
    CHECK((f.quality().reasons & DEFREC_REASON_LOW_CONTRAST) == 0);
    CHECK((f.quality().reasons & DEFREC_REASON_FEW_MATCHES) != 0);
    // Beside faint texture as many may be noise.
    f.data.texture_level = decisions::TextureLevel::kFaint;
    CHECK((f.quality().reasons & DEFREC_REASON_LOW_CONTRAST) != 0);
    f.summary.features = with_defaults({}).max_features / 2;
    CHECK((f.quality().reasons & DEFREC_REASON_LOW_CONTRAST) == 0);
}

TEST_CASE("row 59: tissue under something without depth is occluded where the rest is seen well") {
    Fixture f;
    f.data.landmarks.resize(100);
    f.summary.features = 100;
    const auto hide = [&](bool has_depth) {
        for (size_t i = 0; i < f.output.samples.size(); ++i)
            if (i % 11 < 7) {
                f.output.samples[i].observation = has_depth ? DEFREC_OBSERVED : DEFREC_NO_DEPTH;
                f.output.observations[i].valid = 0;
            }
        const FrameQuality quality = f.quality();
        CHECK(quality.found);
        CHECK(quality.degraded);
        return quality.reasons;
    };
    CHECK(hide(false) == DEFREC_REASON_OCCLUDED);
    CHECK(hide(true) == DEFREC_REASON_LOW_CONTRAST);  // blurred along the motion
    f.summary.features = 49;                          // smoke
    CHECK(hide(false) == (DEFREC_REASON_LOW_CONTRAST | DEFREC_REASON_NO_DEPTH));
}

TEST_CASE(
    "where depth is noisy in a frame, the template's was, and every vertex may be wrong by it") {
    Fixture f;
    const float quiet = f.confidence().expected_error[0];
    for (size_t i = 1; i < f.samples.size(); ++i) f.samples[i].residual = i % 2 == 0 ? 1.5f : -1.5f;
    CHECK(f.confidence().expected_error[0] > 1.3f * quiet);
}

TEST_CASE("a vertex whose depth frames before contradicted is in doubt, whatever this one says") {
    Fixture f;
    const VertexConfidence sure = f.confidence();
    REQUIRE(sure.status[kMiddle] == DEFREC_POINT_OBSERVED);
    f.contradicted_mm.assign(f.samples.size(), 0);
    f.contradicted_mm[kMiddle] = 0.6f;
    const VertexConfidence doubted = f.confidence();
    CHECK(doubted.status[kMiddle] == DEFREC_POINT_EXTRAPOLATED);
    CHECK(doubted.expected_error[kMiddle] > 0.6f);
    CHECK(doubted.status[kMiddle + 1] == DEFREC_POINT_OBSERVED);
    CHECK(doubted.expected_error[kMiddle + 1] == sure.expected_error[kMiddle + 1]);
    // Noise as large as that.
    for (defrec_surface_sample& sample : f.output.samples) sample.residual = 0.3f;
    CHECK(f.confidence().status[kMiddle] == DEFREC_POINT_OBSERVED);
}

TEST_CASE("row 58: without depth and without patches the frame is lost") {
    Fixture f;
    for (defrec_surface_sample& sample : f.output.samples) sample.observation = DEFREC_NO_DEPTH;
    for (defrec_patch_observation& observation : f.output.observations) observation.valid = 0;
    const FrameQuality quality = f.quality();
    CHECK_FALSE(quality.found);
    CHECK((quality.reasons & DEFREC_REASON_NO_DEPTH) != 0);
}

TEST_CASE("a lost surface is found again where depth agrees at more of it than it may by chance") {
    Fixture f;
    const auto agrees_at = [&f](size_t of_hundred) {
        for (size_t i = 0; i < f.samples.size(); ++i)
            f.samples[i].observation = i % 100 < of_hundred ? DEFREC_OBSERVED : DEFREC_NO_DEPTH;
    };
    agrees_at(24);
    CHECK(f.quality(true).found);
    CHECK_FALSE(f.quality(false).found);
    agrees_at(26);
    CHECK(f.quality(false).found);
}

TEST_CASE("row 66: a surface that depth lies far from is degraded, and says so") {
    Fixture f;
    for (defrec_surface_sample& sample : f.output.samples) sample.residual = 0.9f;
    CHECK((f.quality().reasons & DEFREC_REASON_LARGE_RESIDUAL) == 0);
    for (defrec_surface_sample& sample : f.output.samples) sample.residual = -1.1f;
    const FrameQuality quality = f.quality();
    CHECK(quality.found);
    CHECK(quality.degraded);
    CHECK((quality.reasons & DEFREC_REASON_LARGE_RESIDUAL) != 0);
}

TEST_CASE(
    "row 59: half under an instrument is degraded, named occluded, and the hidden half "
    "extrapolated") {
    Fixture f;
    for (size_t i = 0; i < f.output.samples.size(); ++i)
        if (i % 11 < 4) {
            f.output.samples[i].observation = DEFREC_OCCLUDED;
            f.output.observations[i].valid = 0;
        }
    const FrameQuality quality = f.quality();
    CHECK(quality.found);
    CHECK(quality.degraded);
    CHECK((quality.reasons & DEFREC_REASON_OCCLUDED) != 0);

    const VertexConfidence confidence = f.confidence();
    CHECK(confidence.status[0] == DEFREC_POINT_EXTRAPOLATED);
    CHECK(confidence.status[10] == DEFREC_POINT_OBSERVED);
    CHECK(confidence.expected_error[0] > confidence.expected_error[3]);
    CHECK(confidence.expected_error[3] > confidence.expected_error[10]);
    CHECK((confidence.evidence[0] & DEFREC_EVIDENCE_DEPTH) == 0);
    CHECK(confidence.evidence[10] == (DEFREC_EVIDENCE_DEPTH | DEFREC_EVIDENCE_PHOTOMETRIC));
    for (size_t i = 0; i < confidence.expected_error.size(); ++i) {
        const float* covariance = &confidence.covariance[6 * i];
        CHECK(std::sqrt(covariance[0] + covariance[3] + covariance[5]) ==
              doctest::Approx(confidence.expected_error[i]));
    }
}

TEST_CASE("a vertex is observed where depth and image agree with the surface, nowhere else") {
    Fixture f;
    f.output.samples[0].observation = DEFREC_NO_DEPTH;
    f.checks[1].valid = 0;
    f.checks[2].score = 1600;
    f.data.check_of_vertex[3] = -1;
    const VertexConfidence confidence = f.confidence();
    CHECK(confidence.evidence[0] == DEFREC_EVIDENCE_PHOTOMETRIC);
    for (size_t i = 1; i < 4; ++i) CHECK(confidence.evidence[i] == DEFREC_EVIDENCE_DEPTH);
    for (size_t i = 0; i < 4; ++i) {
        CHECK(confidence.status[i] == DEFREC_POINT_EXTRAPOLATED);
        CHECK(confidence.expected_error[i] > 2 * confidence.expected_error[5]);
    }
    CHECK(confidence.status[4] == DEFREC_POINT_OBSERVED);
}

TEST_CASE("where the image contradicts, the error is across the ray; without depth, along it") {
    Fixture f;
    for (defrec_patch_observation& check : f.checks) check.valid = 0;
    const VertexConfidence slid = f.confidence();
    CHECK(slid.covariance[6 * kMiddle] > 0.5f * slid.covariance[6 * kMiddle + 5]);
    Fixture g;
    for (defrec_surface_sample& sample : g.samples) sample.observation = DEFREC_NO_DEPTH;
    const VertexConfidence flat = g.confidence();
    CHECK(flat.covariance[6 * kMiddle] < 0.1f * flat.covariance[6 * kMiddle + 5]);
}

TEST_CASE("checks that fit here and there, among checks that do not, are no evidence") {
    Fixture f;
    for (size_t i = 0; i < f.checks.size(); ++i)
        if (i % 3 == 0) f.checks[i].score = 1600;
    CHECK(f.confidence().evidence[kMiddle] ==
          (DEFREC_EVIDENCE_DEPTH | DEFREC_EVIDENCE_PHOTOMETRIC));
    for (size_t i = 0; i < f.checks.size(); ++i)
        if (i % 2 == 0) f.checks[i].score = 1600;
    CHECK(f.confidence().evidence[kMiddle] == DEFREC_EVIDENCE_DEPTH);
}

TEST_CASE("where most of the surface is refuted, its error is larger, and the frame says so") {
    Fixture f;
    Evidence evidence = f.evidence();
    for (size_t i = 0; i < f.checks.size(); i += 2) f.checks[i] = {};
    const double refuted = f.confidence().expected_error[0];
    for (size_t i = 0; i < f.checks.size(); i += 2) f.samples[i].observation = DEFREC_OCCLUDED;
    const double hidden = f.confidence().expected_error[0],
                 share = 50.0 / 99 - decisions::Confidence::kRefutedByChance;
    CHECK(refuted * refuted - hidden * hidden ==
          doctest::Approx(decisions::ExpectedError::kRefutedShare * share * share));
    evidence.vertices_refuted =
        static_cast<uint32_t>(f.settings.contradicted_share * evidence.vertices_inside);
    CHECK(classify(f.data, evidence, f.settings, true).reasons == 0);
    ++evidence.vertices_refuted;
    const FrameQuality quality = classify(f.data, evidence, f.settings, true);
    CHECK(quality.reasons == DEFREC_REASON_CONTRADICTED);
    CHECK_FALSE(quality.degraded);
}

TEST_CASE("beside another piece at another depth a vertex is not observed, and may be off by it") {
    Fixture f;
    const VertexConfidence whole = f.confidence();
    constexpr float kStep = 10;
    f.data.grid.piece.assign(f.data.grid.vertex.size(), 0);
    for (size_t i = 0; i < f.data.vertices.size(); ++i)
        if (i % 11 > 5) {
            f.data.grid.piece[i] = 1;
            f.data.vertices[i].position[2] += kStep;
        }
    const VertexConfidence parted = f.confidence();
    for (size_t i = 0; i < f.data.vertices.size(); ++i) {
        CAPTURE(i);
        const bool is_beside = i % 11 == 5 || i % 11 == 6;
        CHECK((parted.status[i] == DEFREC_POINT_OBSERVED) == !is_beside);
        const float added = parted.covariance[6 * i + 5] - whole.covariance[6 * i + 5];
        CHECK(added == doctest::Approx(
                           is_beside ? decisions::ExpectedError::kBorderShare * kStep * kStep : 0)
                           .epsilon(1e-3));
    }
    for (size_t i = 0; i < f.data.vertices.size(); ++i)
        if (i % 11 > 5) f.data.vertices[i].position[2] -= 0.9f * kStep;
    CHECK(f.confidence().status == whole.status);  // 1 mm is no step
}

TEST_CASE("where the surface is sheared a check is no evidence, however the camera turns") {
    Fixture f;
    const VertexConfidence still = f.confidence();
    const auto moved = [&](const Eigen::Matrix3d& by) {
        const Eigen::Vector3d centre(0, 0, 80);
        for (size_t i = 0; i < f.samples.size(); ++i) {
            const Eigen::Vector3d rest =
                Eigen::Map<const Eigen::Vector3f>(f.data.vertices[i].position).cast<double>();
            const Eigen::Vector3f now = (centre + by * (rest - centre)).cast<float>();
            std::copy_n(now.data(), 3, f.samples[i].position);
        }
        return f.confidence().status;
    };
    const Eigen::Matrix3d turned =
        Eigen::AngleAxisd(1.3, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    const auto sheared = [](double by) {
        Eigen::Matrix3d made = Eigen::Matrix3d::Identity();
        made(0, 1) = by;
        return made;
    };
    CHECK(moved(turned) == still.status);
    CHECK(moved(turned * Eigen::DiagonalMatrix<double, 3>(1.36, 0.85, 1)) == still.status);
    CHECK(moved(0.5 * turned) == still.status);  // drawn together
    CHECK(moved(sheared(0.5)) == still.status);  // stretches of 1.28 and 0.78
    for (const uint8_t status : moved(turned * sheared(1.5)))
        CHECK(status != DEFREC_POINT_OBSERVED);
}

TEST_CASE("beside sides that slide a check is evidence only where it was located well") {
    Fixture f;
    f.data.node_grid.spacing_u = f.data.node_grid.spacing_v = 40;  // px, two steps of the grid
    const auto slid = [&](float mm, float information) {
        for (size_t i = 0; i < f.samples.size(); ++i) {
            f.samples[i].position[1] = f.data.vertices[i].position[1] + (i % 11 > 5 ? mm : 0);
            f.checks[i].information[0] = f.checks[i].information[2] = information;
        }
        return f.confidence();
    };
    const auto observed_columns = [&](const VertexConfidence& confidence) {
        std::vector<size_t> columns;
        for (size_t i = 44; i < 55; ++i)
            if (confidence.status[i] == DEFREC_POINT_OBSERVED) columns.push_back(i % 11);
        return columns;
    };
    using Columns = std::vector<size_t>;
    // A step of the grid is 8 mm: column 5 is drawn out by 4.0, 1.6 and 1.3.
    constexpr float kSlid = 12, kMaySlide = 3.8f, kBends = 2;
    CHECK(observed_columns(slid(kSlid, 0.6f)) == Columns{0, 1, 2, 3, 4, 6, 7, 8, 9, 10});
    CHECK(observed_columns(slid(kSlid, 0.4f)) == Columns{0, 1, 9, 10});
    CHECK(observed_columns(slid(kMaySlide, 0.1f)).size() == 11);
    CHECK(observed_columns(slid(kMaySlide, 0)) == Columns{0, 1, 9, 10});
    CHECK(observed_columns(slid(kBends, 0)).size() == 11);
}

TEST_CASE("between sides that slide a vertex may be off by half of what they slid") {
    Fixture f;
    const auto error_of = [&](float mm, size_t vertex) {
        for (size_t i = 0; i < f.samples.size(); ++i) {
            f.samples[i].position[1] = f.data.vertices[i].position[1] + (i % 11 > 5 ? mm : 0);
            f.checks[i].valid = i % 11 == 5 || i % 11 == 4 ? 0 : 1;
        }
        return f.confidence().expected_error[vertex];
    };
    for (const size_t vertex : {size_t{44 + 5}, size_t{44 + 4}}) {
        const float together = error_of(0, vertex), apart = error_of(10, vertex),
                    between = vertex % 11 == 5 ? 5 : 0;
        CHECK(apart * apart - together * together ==
              doctest::Approx(between * between).epsilon(0.01));
    }
}

TEST_CASE("beside a cut a vertex may be on the other side, as far as that moves otherwise") {
    Fixture f;
    f.data.node_grid.spacing_u = f.data.node_grid.spacing_v = 40;  // px
    f.data.node_grid.cuts = {{0, {{105, -20}, {105, 180}}}};
    const double sigma = 40 * double{decisions::Confidence::kLineSigma};
    const auto slid = [&](float mm) {
        for (size_t i = 0; i < f.samples.size(); ++i)
            f.samples[i].position[1] = f.data.vertices[i].position[1] + (i % 11 > 5 ? mm : 0);
        return f.confidence();
    };
    const VertexConfidence together = slid(0), apart = slid(10);
    for (size_t i = 0; i < f.samples.size(); ++i) {
        CAPTURE(i);
        const size_t column = i % 11;
        CHECK(together.status[i] == DEFREC_POINT_OBSERVED);
        const double distance = std::abs(20.0 * static_cast<double>(column) - 105),
                     is_beyond = std::erfc(distance / sigma / std::sqrt(2.0)) / 2,
                     added = column == 0 || column == 10 || distance >= 40 ? 0 : is_beyond * 100;
        // The other terms are of where the vertex lies now.
        CHECK(std::abs(apart.expected_error[i] * apart.expected_error[i] -
                       together.expected_error[i] * together.expected_error[i] - added) < 0.01);
        CHECK((apart.status[i] == DEFREC_POINT_OBSERVED) == (std::sqrt(added) < 1));
    }
}

TEST_CASE("patches that lie off the surface raise the error round them") {
    Fixture f;
    const float before = f.confidence().expected_error[40];
    for (defrec_patch_observation& observation : f.observations) observation.u += 2 * 256;
    const float after = f.confidence().expected_error[40];
    CHECK(after > before + 0.2f);
}

TEST_CASE("a late view takes the depth of what moves, and leaves that of what rests") {
    Fixture f;
    std::vector<defrec_surface_sample> last = f.samples;
    for (size_t i = 0; i < last.size(); ++i)
        if (i % 11 > 5) last[i].position[0] -= 2;  // 5 px
    RigEstimate rig;
    rig.lag_frames = 1;
    const VertexConfidence confidence = f.confidence(rig, last);
    CHECK(confidence.status[0] == DEFREC_POINT_OBSERVED);
    CHECK(confidence.status[10] == DEFREC_POINT_EXTRAPOLATED);
    CHECK(confidence.evidence[10] == DEFREC_EVIDENCE_PHOTOMETRIC);
    // The lag moved the right view by 5 px, and a px of disparity is 6.4 mm.
    CHECK(confidence.expected_error[10] > 15);
    CHECK(f.confidence(rig, {}).status[10] == DEFREC_POINT_OBSERVED);
}

TEST_CASE("without depth the image alone finds a surface, and no vertex is observed") {
    Fixture f;
    const float before = f.confidence().expected_error[40];
    for (defrec_surface_sample& sample : f.samples) sample.observation = DEFREC_NO_DEPTH;
    CHECK_FALSE(f.quality().found);
    const FrameQuality quality = classify(f.data, f.evidence(), f.settings, true, false);
    CHECK(quality.found);
    CHECK((quality.reasons & DEFREC_REASON_NO_DEPTH) == 0);
    const VertexConfidence confidence = f.confidence({}, {}, false);
    for (const uint8_t status : confidence.status) CHECK(status == DEFREC_POINT_EXTRAPOLATED);
    for (const uint8_t evidence : confidence.evidence)
        CHECK(evidence == DEFREC_EVIDENCE_PHOTOMETRIC);
    CHECK(confidence.expected_error[40] > before + 1);
    CHECK(f.confidence().status[40] == DEFREC_POINT_UNKNOWN);
}

TEST_CASE("views whose rows do not agree give no depth to rely on, and a larger error") {
    Fixture f;
    RigEstimate rig;
    rig.vertical_offset_px = 1;
    const VertexConfidence confidence = f.confidence(rig);
    for (const uint8_t status : confidence.status) CHECK(status == DEFREC_POINT_EXTRAPOLATED);
    CHECK(confidence.expected_error[40] > f.confidence().expected_error[40] + 1);
}

TEST_CASE("views that converge by an angle give depth that is less sure, and places as before") {
    Fixture f;
    const std::vector<float> parallel = f.confidence().covariance;
    f.data.camera.disparity_offset_px = 80;  // 0.4 of the focal length
    const std::vector<float> converging = f.confidence().covariance;
    const size_t middle = 49;  // on the optical axis
    const double px = std::sqrt(converging[6 * middle + 5] - parallel[6 * middle + 5]) / 6.4;
    CHECK(px == doctest::Approx(0.26).epsilon(0.01));
    for (const size_t axis : {0, 3})
        CHECK(converging[6 * middle + axis] ==
              doctest::Approx(parallel[6 * middle + axis]).epsilon(1e-4));
}

TEST_CASE("what a correction of the vergence leaves is an error of depth, which stays evidence") {
    Fixture f;
    const VertexConfidence sound = f.confidence();
    RigEstimate rig;
    rig.corrected_sigma = 0.001f;
    const VertexConfidence corrected = f.confidence(rig);
    CHECK(corrected.evidence == sound.evidence);
    const float added = corrected.covariance[6 * kMiddle + 5] - sound.covariance[6 * kMiddle + 5],
                per_px = depth_per_px(f.data.camera, 80.0f);
    CHECK(std::sqrt(added) == doctest::Approx(0.2f * per_px).epsilon(1e-3));
}

TEST_CASE("of a vertex' error it is told what all vertices share") {
    Fixture f;
    const float per_px = depth_per_px(f.data.camera, 80.0f);
    const auto shared_px = [&](const VertexConfidence& confidence) {
        return std::sqrt(confidence.common_at(kMiddle)) / per_px;
    };
    CHECK(shared_px(f.confidence()) == 0);
    RigEstimate rows, corrected, turned, late;
    rows.vertical_offset_px = 1;
    CHECK(shared_px(f.confidence(rows)) == 0);  // texture decides what it does to depth
    corrected.corrected_sigma = 0.001f;
    CHECK(shared_px(f.confidence(corrected)) == doctest::Approx(0.2f).epsilon(1e-3));
    turned.vergence = 0.002f;
    CHECK(shared_px(f.confidence(turned)) == doctest::Approx(0.4f).epsilon(1e-3));
    std::vector<defrec_surface_sample> last = f.samples;
    for (defrec_surface_sample& sample : last) sample.position[0] -= 2;  // 5 px
    late.lag_frames = 1;
    CHECK(shared_px(f.confidence(late, last)) == doctest::Approx(5).epsilon(1e-3));
    VertexConfidence alone = f.confidence({}, {}, false);
    CHECK(shared_px(alone) ==
          doctest::Approx(std::sqrt(decisions::ExpectedError::kOneView)).epsilon(1e-3));
    const float* corner = f.samples[0].position;
    const float aside = std::hypot(corner[0], corner[1]) / corner[2];
    CHECK(alone.common_at(0) ==
          doctest::Approx(alone.common_at(kMiddle) * (1 + aside * aside)).epsilon(1e-3));
    forget_vertex(1, kMiddle, alone);
    CHECK(alone.common_at(kMiddle) == 0);
    forget_confidence(1, alone, f.data.vertices.size());
    CHECK(alone.common_at(0) == 0);
}

TEST_CASE("a lost frame trusts no vertex, and less the longer it lasts") {
    Fixture f;
    VertexConfidence early, late;
    forget_confidence(1, early, f.data.vertices.size());
    forget_confidence(20, late, f.data.vertices.size());
    for (const uint8_t status : early.status) CHECK(status == DEFREC_POINT_UNKNOWN);
    for (const uint8_t evidence : early.evidence) CHECK(evidence == 0);
    CHECK(late.expected_error[40] > early.expected_error[40]);
}

TEST_CASE(
    "confidence of a point below the surface is that of the vertex above it, less certain with "
    "depth") {
    Fixture f;
    const VertexConfidence confidence = f.confidence();
    const Template surface(f.data);
    const double on[3] = {0, 0, 80}, below[3] = {0, 0, 110}, beside[3] = {300, 0, 80};
    const SurfaceConfidence at_surface = confidence_at(surface, confidence, on),
                            at_depth = confidence_at(surface, confidence, below);
    CHECK(at_surface.status == DEFREC_POINT_OBSERVED);
    CHECK(at_surface.expected_error == doctest::Approx(confidence.expected_error[0]).epsilon(0.5));
    CHECK(at_depth.expected_error > at_surface.expected_error);
    for (const SurfaceConfidence& at :
         {at_surface, at_depth, confidence_at(surface, confidence, beside)})
        CHECK(std::sqrt(at.covariance[0] + at.covariance[3] + at.covariance[5]) ==
              doctest::Approx(at.expected_error));
    CHECK(confidence_at(surface, confidence, beside).status == DEFREC_POINT_UNKNOWN);
    CHECK(confidence_at(surface, confidence, beside).expected_error >= at_depth.expected_error);
}

TEST_CASE("row 82: nothing is said to be known of a point far off the surface") {
    Fixture f;
    const VertexConfidence confidence = f.confidence();
    const Template surface(f.data);
    const auto at = [&](double z) {
        const double point[3] = {0, 0, z};
        return confidence_at(surface, confidence, point);
    };
    CHECK(at(110).status == DEFREC_POINT_OBSERVED);
    CHECK(at(130).status == DEFREC_POINT_EXTRAPOLATED);
    for (const double z : {200.0, 1e3, 1e30, 1e200, 1e308}) {
        CAPTURE(z);
        CHECK(at(z).status == DEFREC_POINT_UNKNOWN);
        CHECK(std::isfinite(at(z).expected_error));
        CHECK(std::isfinite(at(z).covariance[5]));
    }
}

TEST_CASE("a point beside the surface is extrapolated, less certain with the distance") {
    Fixture f;
    const VertexConfidence confidence = f.confidence();
    const Vec3<double> place{20, 5, 80};
    double last = confidence.expected_error[40];
    for (const double distance : {1.0, 5.0, 15.0}) {
        const SurfaceConfidence at = confidence_beside(confidence, 40, distance, place);
        CHECK(at.status == DEFREC_POINT_EXTRAPOLATED);
        CHECK(at.evidence == 0);
        CHECK(at.expected_error > last);
        CHECK(std::sqrt(at.covariance[0] + at.covariance[3] + at.covariance[5]) ==
              doctest::Approx(at.expected_error));
        last = at.expected_error;
    }
    CHECK(confidence_beside(confidence, 40, 41, place).status == DEFREC_POINT_UNKNOWN);
    const SurfaceConfidence at_camera = confidence_beside(confidence, 40, 5, {0, 0, 0});
    CHECK(at_camera.status == DEFREC_POINT_UNKNOWN);
    CHECK(std::isfinite(at_camera.expected_error));
    VertexConfidence lost;
    forget_confidence(1, lost, f.data.vertices.size());
    CHECK(confidence_beside(lost, 40, 1, place).status == DEFREC_POINT_UNKNOWN);
}

TEST_CASE("the rigid motion of a rigidly moved surface is that motion") {
    Fixture f;
    const double angle = 0.3, cosine = std::cos(angle), sine = std::sin(angle);
    for (size_t i = 0; i < f.data.vertices.size(); ++i) {
        const float* p = f.data.vertices[i].position;
        f.output.samples[i].position[0] = static_cast<float>(cosine * p[0] - sine * p[1] + 3);
        f.output.samples[i].position[1] = static_cast<float>(sine * p[0] + cosine * p[1] - 2);
        f.output.samples[i].position[2] = p[2] + 7;
    }
    double motion[12];
    const SurfaceModel model(f.data);
    const SurfaceSamples samples(f.samples);
    const size_t half = samples.size() / 2;
    const RigidSums runs[] = {sum_for_rigid_motion(model, samples.first(half), 0),
                              sum_for_rigid_motion(model, samples.subspan(half), half)};
    fit_rigid_motion(model, runs, motion);
    const double expected[12] = {cosine, -sine, 0, 3, sine, cosine, 0, -2, 0, 0, 1, 7};
    for (int i = 0; i < 12; ++i) CHECK(motion[i] == doctest::Approx(expected[i]).epsilon(1e-4));
}

namespace {

ImageStatistics statistics_of(const std::vector<uint8_t>& gray, uint32_t width, uint32_t height,
                              const int32_t* map = nullptr) {
    const GraySums sums[] = {sum_gray(gray.data(), width, height, {0, height}, map)};
    return image_statistics(sums);
}

}  // namespace

TEST_CASE("row 58: exposure of black, white and ordinary images") {
    const std::vector<uint8_t> black(64 * 48, 2), white(64 * 48, 255);
    std::vector<uint8_t> ordinary(64 * 48);
    for (size_t i = 0; i < ordinary.size(); ++i) ordinary[i] = static_cast<uint8_t>(60 + i % 90);
    CHECK(statistics_of(black, 64, 48).dark());
    CHECK(statistics_of(white, 64, 48).saturated());
    const ImageStatistics statistics = statistics_of(ordinary, 64, 48);
    CHECK_FALSE(statistics.dark());
    CHECK_FALSE(statistics.saturated());
    CHECK(statistics.deviation > 5);
    CHECK(statistics.hash != statistics_of(black, 64, 48).hash);
}

TEST_CASE("an image whose rows alternate between two times is interlaced, noise is not") {
    constexpr uint32_t kWidth = 160, kHeight = 120;
    const auto pattern = [](double x, double y) {
        return 120 + 50 * std::sin(x / 7 + y / 23) + 30 * std::sin(y / 5 - x / 31);
    };
    std::vector<uint8_t> still(kWidth * kHeight), moving(still.size()), noise(still.size());
    uint32_t random = 1;
    for (uint32_t y = 0; y < kHeight; ++y)
        for (uint32_t x = 0; x < kWidth; ++x) {
            const size_t i = size_t{y} * kWidth + x;
            still[i] = static_cast<uint8_t>(pattern(x, y));
            moving[i] = static_cast<uint8_t>(pattern(x + (y % 2 == 0 ? 0 : 6), y));
            random = 1664525 * random + 1013904223;
            noise[i] = static_cast<uint8_t>(random >> 24);
        }
    const auto ratio = [](const std::vector<uint8_t>& gray) {
        return statistics_of(gray, kWidth, kHeight).row_ratio;
    };
    CHECK(ratio(still) < 0.8);
    CHECK(ratio(moving) > 1.3);
    CHECK(statistics_of(moving, kWidth, kHeight).interlaced());
    CHECK(ratio(noise) == doctest::Approx(1).epsilon(0.1));
    CHECK_FALSE(statistics_of(noise, kWidth, kHeight).interlaced());
    CHECK(ratio(std::vector<uint8_t>(still.size(), 90)) == 0);
    const std::vector<int32_t> map(2 * still.size(), 0);  // of rectified rows nothing is known
    CHECK(statistics_of(moving, kWidth, kHeight, map.data()).row_ratio == 0);
}

TEST_CASE("what the camera did not see says nothing of a rectified image's exposure") {
    std::vector<uint8_t> gray(64 * 48, 120);
    std::vector<int32_t> map(2 * gray.size());
    std::fill(gray.begin() + 64 * 24, gray.end(), uint8_t{0});
    std::fill(map.begin() + 2 * 64 * 24, map.end(), INT32_MIN);
    CHECK(statistics_of(gray, 64, 48).mean == 60);
    const ImageStatistics statistics = statistics_of(gray, 64, 48, map.data());
    CHECK(statistics.mean == 120);
    CHECK(statistics.deviation == 0);
}

TEST_CASE("an image's statistics are those of its parts, but for the hash, which is of the parts") {
    constexpr uint32_t kWidth = 150, kHeight = 101;
    std::vector<uint8_t> gray(kWidth * kHeight);
    for (size_t i = 0; i < gray.size(); ++i) gray[i] = static_cast<uint8_t>(i * i / 7 % 256);
    std::vector<int32_t> map(2 * gray.size());
    std::fill(map.begin() + 2 * kWidth * 70, map.end(), INT32_MIN);
    for (const int32_t* given : {static_cast<const int32_t*>(nullptr), std::as_const(map).data()}) {
        const ImageStatistics whole = statistics_of(gray, kWidth, kHeight, given);
        const auto sums = [&](uint32_t first, uint32_t last) {
            return sum_gray(gray.data(), kWidth, kHeight, {first, last}, given);
        };
        const GraySums parts[] = {sums(0, 0), sums(0, 37), sums(37, 96), sums(96, kHeight)};
        const ImageStatistics of_parts = image_statistics(parts);
        CHECK(of_parts.mean == whole.mean);
        CHECK(of_parts.deviation == whole.deviation);
        CHECK(of_parts.saturated_share == whole.saturated_share);
        CHECK(of_parts.row_ratio == whole.row_ratio);
        gray[kWidth * 38 + 2] ^= 1;
        const GraySums others[] = {parts[0], parts[1], sums(37, 96), parts[3]};
        CHECK(image_statistics(others).hash != of_parts.hash);
        gray[kWidth * 38 + 2] ^= 1;
    }
}
