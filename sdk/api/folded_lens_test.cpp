// The tracker through the C API with cameras whose distortion folds within the image.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "sdk/testing/test_film.hpp"
#include "sdk/testing/test_session.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

constexpr int kFilmWidth = 640, kFilmHeight = 360;
// What lies at radius r is seen at r (1 + kDistortion r^2), which grows up to kFold.
constexpr double kFocalPx = 1050, kDistortion = -2, kFold = 0.4082;

double seen_at(double radius) { return radius * (1 + kDistortion * radius * radius); }

// The directions' radius of what is seen at this one; NaN beyond the fold.
double radius_of(double seen) {
    if (seen > seen_at(kFold)) return std::nan("");
    double low = 0, high = kFold;
    for (int i = 0; i < 40; ++i) {
        const double middle = (low + high) / 2;
        (seen_at(middle) < seen ? low : high) = middle;
    }
    return low;
}

// Film through the folding lens; noise beyond the fold.
class FoldedView {
  public:
    explicit FoldedView(const cli::Lens& filmed) {
        constexpr double kCx = (kFilmWidth - 1) / 2.0, kCy = (kFilmHeight - 1) / 2.0;
        for (int y = 0; y < kFilmHeight; ++y)
            for (int x = 0; x < kFilmWidth; ++x) {
                const double dx = (x - kCx) / kFocalPx, dy = (y - kCy) / kFocalPx;
                const double seen = std::hypot(dx, dy), scale = radius_of(seen) / seen;
                from_.push_back(
                    {filmed.fx * scale * dx + filmed.cx, filmed.fy * scale * dy + filmed.cy});
                const Eigen::Vector2d& at = from_.back();
                const bool is_filmed = at.x() >= 0 && at.x() < kFilmWidth - 1 && at.y() >= 0 &&
                                       at.y() < kFilmHeight - 1;
                REQUIRE((std::isnan(at.x()) || is_filmed));
            }
    }
    std::vector<uint8_t> picture(const std::vector<uint8_t>& film) {
        std::vector<uint8_t> bgr(film.size());
        for (size_t i = 0; i < from_.size(); ++i)
            for (size_t channel = 0; channel < 3; ++channel)
                bgr[3 * i + channel] = std::isnan(from_[i].x())
                                           ? static_cast<uint8_t>((noise_ *= 1664525u) >> 24)
                                           : sample(film, from_[i], channel);
        return bgr;
    }

  private:
    static uint8_t sample(const std::vector<uint8_t>& film, const Eigen::Vector2d& at,
                          size_t channel) {
        const auto x = static_cast<size_t>(at.x()), y = static_cast<size_t>(at.y());
        const double a = at.x() - static_cast<double>(x), b = at.y() - static_cast<double>(y);
        const uint8_t* p = &film[3 * (y * kFilmWidth + x) + channel];
        const uint8_t* below = p + size_t{3} * kFilmWidth;
        return static_cast<uint8_t>((1 - b) * ((1 - a) * p[0] + a * p[3]) +
                                    b * ((1 - a) * below[0] + a * below[3]) + 0.5);
    }
    std::vector<Eigen::Vector2d> from_;  // px of the film; NaN beyond the fold
    uint32_t noise_ = 12345;
};

}  // namespace

TEST_CASE("row 105: a distortion that folds at the corners is tracked within the fold") {
    constexpr int kFrames = 6;
    cli::Film film("heartbeat", kFilmWidth, kFilmHeight, kFrames, 1, 2);
    const cli::StereoRig& filmed = film.scene().rig;
    FoldedView view(filmed.left);
    std::string log;
    TrackingSession session(
        "cpu", 2,
        [&](defrec_rig_desc& rig, defrec_tracker_desc& tracker) {
            describe_rig(filmed, kFilmWidth, kFilmHeight, rig);
            rig.left = rig.right = {
                kFocalPx, kFocalPx, filmed.left.cx, filmed.left.cy, {kDistortion}, 4, 0};
            tracker.format = DEFREC_FORMAT_BGR8;
        },
        [&](defrec_context_desc& context) {
            context.log_level = DEFREC_LOG_WARNING;
            context.log_user = &log;
            context.log = [](void* user, int32_t, const char*, const char* text) {
                static_cast<std::string*>(user)->append(text).append("\n");
            };
        });
    INFO(log);
    CHECK(log.find("left.distortion") != std::string::npos);
    CHECK(log.find("right.distortion") != std::string::npos);
    defrec_rig_info info;
    DEFREC_INIT(&info);
    REQUIRE_OK(defrec_rig_get(session.rig, &info));

    std::vector<double> on_surface;
    std::vector<size_t> filmed_point;  // of each point on the surface
    for (int i = 0; i < kFrames; ++i) {
        CAPTURE(i);
        film.advance();
        const std::vector<uint8_t> left = view.picture(film.left_bgr()),
                                   right = view.picture(film.right_bgr());
        TrackingSession::Frame frame;
        frame.left.pixels = left.data();
        frame.right.pixels = right.data();
        defrec_job job = nullptr;
        REQUIRE_OK(session.submit(frame, &job));
        REQUIRE_OK(defrec_job_wait(job, UINT64_MAX));
        if (i == 0) {
            defrec_template surface = nullptr;
            REQUIRE_OK(defrec_tracker_get_template(session.tracker, &surface));
            for (size_t p = 0; p < film.points().size(); ++p) {
                const double x = (film.points()[p].u - filmed.left.cx) / filmed.left.fx,
                             y = (film.points()[p].v - filmed.left.cy) / filmed.left.fy;
                const double pixel[2] = {info.camera.fx * x + info.camera.cx,
                                         info.camera.fy * y + info.camera.cy};
                double xyz[3];
                uint8_t found = 0;
                REQUIRE_OK(defrec_template_lift(surface, pixel, 1, xyz, &found));
                if (found == 0) continue;
                on_surface.insert(on_surface.end(), xyz, xyz + 3);
                filmed_point.push_back(p);
            }
            defrec_template_release(surface);
            CHECK(filmed_point.size() > 100);
        }
        defrec_result result;
        DEFREC_INIT(&result);
        REQUIRE_OK(defrec_job_result(job, &result));
        CHECK(result.state == DEFREC_TRACKING);
        size_t with_depth = 0;
        for (size_t v = 0; v < result.vertex_count; ++v) {
            if ((result.vertex_evidence[v] & DEFREC_EVIDENCE_DEPTH) == 0) continue;
            const float* at = &result.vertices[3 * v];
            REQUIRE(std::hypot(at[0] / at[2], at[1] / at[2]) < kFold + 0.003);
            ++with_depth;
        }
        CHECK(2 * with_depth > result.vertex_count);

        std::vector<double> xyz(on_surface.size()), expected(filmed_point.size()), errors;
        std::vector<uint8_t> status(filmed_point.size());
        REQUIRE_OK(defrec_job_warp_points(job, on_surface.data(), filmed_point.size(), xyz.data(),
                                          status.data(), expected.data()));
        for (size_t p = 0; p < filmed_point.size(); ++p)
            if (status[p] == DEFREC_POINT_OBSERVED)
                errors.push_back((Eigen::Map<const Eigen::Vector3d>(&xyz[3 * p]) -
                                  film.truth(filmed_point[p]).position)
                                     .norm());
        std::sort(errors.begin(), errors.end());
        REQUIRE(3 * errors.size() > filmed_point.size());
        CHECK(errors[errors.size() / 2] < 0.15);
        CHECK(errors[errors.size() * 95 / 100] < 0.5);
        defrec_job_release(job);
    }
}
