// See plan_painter.hpp.
#include "sdk/report/plan_painter.hpp"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "sdk/report/drawing.hpp"
#include "sdk/report/plan_outline.hpp"

namespace defrec::cli {
namespace {

// The live view's page (web/plan.js) uses the same ones, part after part.
const cv::Scalar kPartColours[] = {{246, 92, 236}, {160, 230, 90},  {250, 180, 90},
                                   {64, 128, 251}, {180, 120, 255}, {80, 220, 240}};
constexpr double kFill = 0.10, kHalo = 0.30;  // shares of the colour
constexpr std::size_t kDash = 3;              // points of an outline, and as many of a gap

const cv::Scalar& colour_of(std::size_t part) {
    return kPartColours[part % std::size(kPartColours)];
}

bool is_edge(const OutlinePoint& point) { return !point.is_unknown && !point.is_cut; }

void tint(cv::Mat& image, const cv::Mat1b& mask, const cv::Scalar& colour, double share) {
    const cv::Rect area = cv::boundingRect(mask);
    if (area.empty()) return;
    cv::Mat part = image(area), tinted;
    cv::addWeighted(part, 1 - share, cv::Mat(part.size(), part.type(), colour), share, 0, tinted);
    tinted.copyTo(part, mask(area));
}

void fill(cv::Mat& image, const PlanOutline& outline) {
    std::vector<std::vector<cv::Point>> polygons;
    for (const auto& contour : outline.contours) {
        polygons.emplace_back();
        for (const OutlinePoint& point : contour)
            polygons.back().push_back(fixed_point(point.u, point.v));
    }
    cv::Mat1b mask(image.size(), std::uint8_t{0});
    cv::fillPoly(mask, polygons, 255, cv::LINE_8, kSubpixelBits);
    tint(image, mask, colour_of(outline.part), kFill);
}

void draw_halo(cv::Mat& image, const PlanOutline& outline) {
    cv::Mat1b mask(image.size(), std::uint8_t{0});
    for (const auto& contour : outline.contours)
        for (const OutlinePoint& point : contour)
            if (is_edge(point))
                cv::circle(mask, fixed_point(point.u, point.v),
                           cvRound(std::max(1.0F, point.radius) * (1 << kSubpixelBits)), 255,
                           cv::FILLED, cv::LINE_8, kSubpixelBits);
    tint(image, mask, colour_of(outline.part), kHalo);
}

void draw_edges(cv::Mat& image, const PlanOutline& outline) {
    const int thickness = std::max(1, image.cols / 480);
    for (const auto& contour : outline.contours)
        for (std::size_t i = 0; i < contour.size(); ++i) {
            const OutlinePoint &a = contour[i], &b = contour[(i + 1) % contour.size()];
            if (a.is_cut && b.is_cut) continue;
            const bool is_whole = is_edge(a) && is_edge(b);
            if (!is_whole && i / kDash % 2 == 1) continue;
            cv::line(image, fixed_point(a.u, a.v), fixed_point(b.u, b.v),
                     is_whole ? colour_of(outline.part) : status_colour(VertexStatus::unknown),
                     thickness, cv::LINE_AA, kSubpixelBits);
        }
}

void label(Labels& labels, const PlanOutline& outline, const std::string& name) {
    const OutlinePoint* top = nullptr;
    for (const auto& contour : outline.contours)
        for (const OutlinePoint& point : contour)
            if (top == nullptr || point.v < top->v) top = &point;
    labels.add(Labels::Rank::kPart, label_text(name, double{outline.expected_error_mm}), top->u,
               top->v);
}

}  // namespace

void draw_plan(cv::Mat& image, const PlanEstimate& plan, const Projector& projector,
               Labels& labels) {
    const std::vector<PlanOutline> outlines =
        plan_outlines(plan, projector, image.cols, image.rows);
    for (const PlanOutline& outline : outlines) {
        fill(image, outline);
        draw_halo(image, outline);
    }
    for (const PlanOutline& outline : outlines) draw_edges(image, outline);
    for (const PlanOutline& outline : outlines)
        label(labels, outline, plan.model->parts[outline.part].name);
    const auto unnamed = static_cast<std::size_t>(
        std::count_if(plan.targets.begin(), plan.targets.end(),
                      [](const PointEstimate& target) { return target.name.empty(); }));
    for (const PointEstimate& target : plan.targets) {
        if (!draw_target(image, target, projector) || plan.targets.size() > kMostLabels ||
            (target.name.empty() && unnamed > kMostNumbered))
            continue;
        const TargetMark mark = target_mark(target, projector);
        labels.add(
            Labels::Rank::kTarget,
            label_text(target.name.empty() ? "target " + std::to_string(target.id) : target.name,
                       double{expected_error(target)}),
            mark.u, mark.v);
    }
}

}  // namespace defrec::cli
