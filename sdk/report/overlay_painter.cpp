// Draws one frame's result on the left image.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "sdk/report/drawing.hpp"
#include "sdk/report/overlay.hpp"
#include "sdk/report/plan_painter.hpp"
#include "sdk/report/reason_words.hpp"
#include "sdk/report/surface_lattice.hpp"
#include "sdk/report/told_state.hpp"

namespace defrec::cli {
namespace {

const cv::Scalar kInlier(246, 110, 40);
const cv::Scalar kOutlier(40, 30, 26);
const cv::Scalar kControlPoint(255, 255, 255);
const cv::Scalar kMuted(190, 190, 190);

constexpr int kNodesPerLine =
    4;  // lattice nodes from one grid line to the next: lines bend with the surface
cv::Scalar state_colour(std::string_view state) {
    if (state == "tracking") return {61, 128, 21};
    if (state == "degraded") return {9, 83, 180};
    if (state == "relocalised" || state == "found") return {237, 58, 124};
    if (doubt_of(state) != Doubt::none) return {38, 38, 220};
    return {105, 85, 71};
}

void line(cv::Mat& image, const float* a, const float* b, const cv::Scalar& colour) {
    if (near_image(a[0], a[1], image) && near_image(b[0], b[1], image))
        cv::line(image, fixed_point(a[0], a[1]), fixed_point(b[0], b[1]), colour, 1, cv::LINE_AA,
                 kSubpixelBits);
}

void dot(cv::Mat& image, float u, float v, double radius, const cv::Scalar& colour) {
    if (near_image(u, v, image))
        cv::circle(image, fixed_point(u, v), cvRound(radius * (1 << kSubpixelBits)), colour,
                   cv::FILLED, cv::LINE_AA, kSubpixelBits);
}

void darken(cv::Mat& image, cv::Rect area, double keep) {
    area &= cv::Rect(0, 0, image.cols, image.rows);
    if (area.empty()) return;
    cv::Mat part = image(area);
    part.convertTo(part, -1, keep);
}

std::string format(const char* pattern, auto... values) {
    char text[160];
    std::snprintf(text, sizeof text, pattern, values...);
    return text;
}

/// One row of text from left to right; what does not fit is left out.
class TextRow {
  public:
    TextRow(cv::Mat& image, int left, int baseline, double scale)
        : image_(image), left_(left), baseline_(baseline), scale_(scale) {}

    void add(const std::string& text, const cv::Scalar& colour,
             const cv::Scalar* background = nullptr) {
        int below = 0;
        const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale_, 1, &below);
        if (left_ + size.width > image_.cols - 2) return;
        if (background)
            cv::rectangle(image_, cv::Point(left_ - 4, baseline_ - size.height - 4),
                          cv::Point(left_ + size.width + 4, baseline_ + below), *background,
                          cv::FILLED);
        cv::putText(image_, text, cv::Point(left_, baseline_), cv::FONT_HERSHEY_SIMPLEX, scale_,
                    colour, 1, cv::LINE_AA);
        left_ += size.width + cvRound(36 * scale_);
    }

  private:
    cv::Mat& image_;
    int left_, baseline_;
    double scale_;
};

/// "points: 3 tracked, 1 extrapolated, 2 lost"; empty without any that the user chose.
std::string points_text(const std::vector<PointEstimate>& points) {
    int counts[3] = {};
    for (const PointEstimate& point : points)
        if (point.is_chosen) ++counts[static_cast<std::size_t>(point.status)];
    if (counts[0] + counts[1] + counts[2] == 0) return {};
    return format("points: %d tracked, %d extrapolated, %d lost", counts[0], counts[1], counts[2]);
}

std::string label_of(const PointEstimate& point) {
    const std::string name =
        point.name.empty() ? format("#%lld", static_cast<long long>(point.id)) : point.name;
    return label_text(name, double{expected_error(point)});
}

/// Which points have labels, the same ones in every frame: chosen ones with a name first, then as
/// many of the other chosen ones as have room, evenly.
std::vector<bool> labelled(const std::vector<PointEstimate>& points) {
    std::vector<std::size_t> order;
    for (const bool has_name : {true, false}) {
        std::vector<std::size_t> kind;
        for (std::size_t i = 0; i < points.size(); ++i)
            if (points[i].is_chosen && !points[i].name.empty() == has_name) kind.push_back(i);
        const std::size_t room = std::min(kind.size(), kMostLabels - order.size());
        for (std::size_t k = 0; k < room; ++k) order.push_back(kind[k * kind.size() / room]);
    }
    std::vector<bool> is_labelled(points.size());
    for (const std::size_t i : order) is_labelled[i] = true;
    return is_labelled;
}

int head_row_height(const cv::Mat& image) { return cvRound(44 * text_scale(image)); }

// A row each for the state, for the numbers behind it where they are asked for, and for reasons.
int head_height(const cv::Mat& image, const std::string& reasons, OverlayDetail detail) {
    const int rows = 1 + (detail == OverlayDetail::all ? 1 : 0) + (reasons.empty() ? 0 : 1);
    return rows * head_row_height(image) + 2;
}

void draw_head(cv::Mat& image, const FrameRecord& frame, const std::string& told,
               const std::string& reasons, OverlayDetail detail) {
    const double scale = text_scale(image);
    const int row_height = head_row_height(image), left = cvRound(16 * scale) + 4;
    darken(image, {0, 0, image.cols, head_height(image, reasons, detail)}, 0.38);
    const cv::Scalar state = state_colour(told);
    int baseline = cvRound(0.75 * row_height);

    TextRow first(image, left, baseline, scale);
    first.add(told.empty() ? "no state" : std::string(word_of_state(told)), kLight, &state);
    first.add(format("frame %lld", static_cast<long long>(frame.index)), kLight);
    first.add(format("%.3f s", frame.timestamp_ms / 1000), kMuted);
    first.add(points_text(frame.points), kLight);
    first.add(format("%.0f %% of the surface observed", 100 * frame.observed_share), kLight);

    if (detail == OverlayDetail::all) {
        TextRow second(image, left, baseline += row_height, scale);
        second.add(std::isfinite(frame.mean_residual_mm)
                       ? format("mean residual %.2f mm", frame.mean_residual_mm)
                       : "mean residual -",
                   kLight);
        second.add(format("inliers %d of %d", frame.inliers, frame.matches), kLight);
        if (frame.frame_ms > 0) second.add(format("%.1f ms", frame.frame_ms), kMuted);
    }

    TextRow last(image, left, baseline + row_height, scale);
    for (const std::string& reason : reasons_in_words(reasons, frame.faulty_views))
        last.add(reason, status_colour(VertexStatus::extrapolated));
}

void draw_legend(cv::Mat& image, const FrameRecord& frame, OverlayDetail detail) {
    const double scale = 0.85 * text_scale(image);
    const int row_height = cvRound(40 * scale);
    darken(image, {0, image.rows - row_height, image.cols, row_height}, 0.45);
    TextRow row(image, cvRound(16 * scale) + 4, image.rows - cvRound(0.3 * row_height), scale);
    row.add("surface:", kMuted);
    row.add("observed", status_colour(VertexStatus::observed));
    row.add("extrapolated", status_colour(VertexStatus::extrapolated));
    row.add("unknown", status_colour(VertexStatus::unknown));
    const bool has_points = std::any_of(frame.points.begin(), frame.points.end(),
                                        [](const auto& point) { return point.is_chosen; });
    if (has_points) row.add("o point, expected error", kControlPoint);
    if (!frame.targets.empty() || !frame.plan.targets.empty())
        row.add("o target, expected error", kControlPoint);
    if (!frame.plan.vertices.empty()) row.add("plan, halo: expected error", kControlPoint);
    row.add("recognised", {255, 160, 90});
    if (detail != OverlayDetail::all) return;
    row.add("(dark: refused)", kMuted);
    row.add("+ control point", kControlPoint);
}

void frame_lost(cv::Mat& image, std::string_view told) {
    if (doubt_of(told) == Doubt::lost || doubt_of(told) == Doubt::frozen)
        cv::rectangle(image, cv::Rect(0, 0, image.cols, image.rows), state_colour(told), 3);
}

}  // namespace

struct OverlayPainter::Impl {
    Projector projector;
    OverlayDetail detail = OverlayDetail::usual;
    std::size_t vertices = 0;
    SurfaceLattice lattice;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> lines;
    LatticeState state;
    std::vector<float> uv;

    void collect_lines();
    void draw_grid(cv::Mat& image, const FrameRecord& frame);
    void draw_matches(cv::Mat& image, const FrameRecord& frame) const;
    void draw_control_points(cv::Mat& image, const FrameRecord& frame);
    void draw_points(cv::Mat& image, const FrameRecord& frame, Labels& labels) const;
    void draw_targets(cv::Mat& image, const FrameRecord& frame) const;
    void draw_marks(cv::Mat& image, const FrameRecord& frame, const std::string& reasons);
};

void OverlayPainter::Impl::collect_lines() {
    lines.clear();
    const auto add = [this](std::int32_t a, std::int32_t b) {
        lines.emplace_back(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
    };
    for (int row = 0; row < lattice.rows(); ++row)
        for (int column = 0; column < lattice.columns(); ++column) {
            if (row % kNodesPerLine == 0 && lattice.goes_on_right(column, row))
                add(lattice.node(column, row), lattice.node(column + 1, row));
            if (column % kNodesPerLine == 0 && lattice.goes_on_down(column, row))
                add(lattice.node(column, row), lattice.node(column, row + 1));
        }
}

void OverlayPainter::Impl::draw_grid(cv::Mat& image, const FrameRecord& frame) {
    if (!has_geometry(frame, vertices) || lattice.size() == 0) return;
    lattice.evaluate(frame, state);
    uv.resize(2 * lattice.size());
    projector(state.xyz.data(), lattice.size(), uv.data());
    for (const auto& [a, b] : lines) {
        const VertexStatus worse =
            state.status[a] == VertexStatus::observed ? state.status[b] : state.status[a];
        line(image, uv.data() + 2 * a, uv.data() + 2 * b, status_colour(worse));
    }
}

void OverlayPainter::Impl::draw_matches(cv::Mat& image, const FrameRecord& frame) const {
    for (const bool inlier : {false, true})
        for (const MatchSegment& match : frame.matched) {
            if (match.inlier != inlier || (!inlier && detail != OverlayDetail::all)) continue;
            const cv::Scalar& colour = inlier ? kInlier : kOutlier;
            const float from[2] = {match.template_u, match.template_v},
                        to[2] = {match.live_u, match.live_v};
            line(image, from, to, colour);
            dot(image, to[0], to[1], 1.6, colour);
        }
}

void OverlayPainter::Impl::draw_control_points(cv::Mat& image, const FrameRecord& frame) {
    if (detail != OverlayDetail::all) return;
    const std::size_t count = frame.control_points.size() / 3;
    uv.resize(2 * count);
    if (count > 0) projector(frame.control_points.data(), count, uv.data());
    for (std::size_t i = 0; i < count; ++i) {
        const float u = uv[2 * i], v = uv[2 * i + 1];
        if (near_image(u, v, image))
            cv::drawMarker(image, cv::Point(cvRound(u), cvRound(v)), kControlPoint,
                           cv::MARKER_CROSS, 5, 1);
    }
}

// A dot with a ring as wide as the expected error, dashed where the point is not observed. What is
// lost has no place.
void OverlayPainter::Impl::draw_points(cv::Mat& image, const FrameRecord& frame,
                                       Labels& labels) const {
    const double radius = std::max(2.0, image.cols / 400.0);
    const std::vector<bool> is_labelled = labelled(frame.points);
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
        const PointEstimate& point = frame.points[i];
        if (!point.is_chosen || point.status == VertexStatus::unknown) continue;
        const TargetMark mark = target_mark(point, projector);
        if (!near_image(mark.u, mark.v, image)) continue;
        const cv::Scalar& colour = status_colour(point.status);
        dot(image, mark.u, mark.v, radius + 1.5, kDark);
        dot(image, mark.u, mark.v, radius, colour);
        if (std::isfinite(mark.radius))
            ring(image, mark.u, mark.v, std::max(double(mark.radius), radius + 2),
                 point.status != VertexStatus::observed, colour);
        if (is_labelled[i]) labels.add(Labels::Rank::kPoint, label_of(point), mark.u, mark.v);
    }
}

void OverlayPainter::Impl::draw_targets(cv::Mat& image, const FrameRecord& frame) const {
    for (const TargetEstimate& target : frame.targets) draw_target(image, target, projector);
}

OverlayPainter::OverlayPainter(Projector projector, OverlayDetail detail)
    : impl_(std::make_unique<Impl>()) {
    impl_->projector = std::move(projector);
    impl_->detail = detail;
}

OverlayPainter::~OverlayPainter() = default;

void OverlayPainter::set_template(const TemplateRecord& reference) {
    check_template(reference);
    // About 26 lines over the template's width, whatever the image's size.
    const double step = std::max(2.0, std::sqrt(template_area(reference)) / (26 * kNodesPerLine));
    impl_->vertices = reference.vertices.size() / 3;
    impl_->lattice = SurfaceLattice(reference, step);
    impl_->collect_lines();
}

void OverlayPainter::Impl::draw_marks(cv::Mat& image, const FrameRecord& frame,
                                      const std::string& reasons) {
    draw_grid(image, frame);
    draw_matches(image, frame);
    draw_control_points(image, frame);
    Labels labels;
    draw_plan(image, frame.plan, projector, labels);
    draw_points(image, frame, labels);
    draw_targets(image, frame);
    labels.draw(image, head_height(image, reasons, detail));
}

void OverlayPainter::draw_without_text(cv::Mat& image, const FrameRecord& frame) {
    impl_->draw_marks(image, frame, frame.reasons);
}

void OverlayPainter::draw(cv::Mat& image, const FrameRecord& frame, std::string_view told) {
    const std::string state = told.empty() ? frame.state : std::string(told),
                      reasons = reasons_told(frame, state);
    impl_->draw_marks(image, frame, reasons);
    draw_head(image, frame, state, reasons, impl_->detail);
    draw_legend(image, frame, impl_->detail);
    frame_lost(image, state);
}

}  // namespace defrec::cli
