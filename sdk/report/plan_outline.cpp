// See plan_outline.hpp.
#include "sdk/report/plan_outline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

namespace defrec::cli {
namespace {

constexpr int kMostColumns = 960;         // of the masks: wider images are drawn on smaller ones
constexpr int kStep = 3;                  // of a mask's pixels, between points of an outline
constexpr std::size_t kFewestPoints = 8;  // of a mask's contour: less is a speck

// A plan's vertices in a mask.
struct Projected {
    float scale = 1;  // mask from image
    cv::Size size;
    std::vector<cv::Point2f> at;
    std::vector<float> radius;

    Projected(const PlanEstimate& plan, const Projector& projector, int width, int height)
        : scale(std::min(1.0F, static_cast<float>(kMostColumns) / static_cast<float>(width))),
          size(cvCeil(static_cast<float>(width) * scale),
               cvCeil(static_cast<float>(height) * scale)) {
        const std::size_t count = plan.status.size();
        std::vector<float> aside = plan.vertices, uv(2 * count), uv_aside(2 * count);
        for (std::size_t i = 0; i < count; ++i) aside[3 * i] += plan.expected_error_mm[i];
        projector(plan.vertices.data(), count, uv.data());
        projector(aside.data(), count, uv_aside.data());
        for (std::size_t i = 0; i < count; ++i) {
            at.emplace_back(scale * uv[2 * i], scale * uv[2 * i + 1]);
            radius.push_back(scale * std::hypot(uv_aside[2 * i] - uv[2 * i],
                                                uv_aside[2 * i + 1] - uv[2 * i + 1]));
        }
    }

    // Far beside the image a projection tells nothing.
    bool is_near(std::size_t vertex) const {
        const auto [u, v] = at[vertex];
        const auto far = static_cast<float>(4 * kMostColumns);
        return u > -far && v > -far && u < far && v < far;  // false for NaN
    }
};

struct PartMasks {
    cv::Mat1b known, unknown;
    cv::Mat1f radius;
    double squared_error = 0;
    std::size_t corners = 0;  // that are known

    explicit PartMasks(cv::Size size)
        : known(size, std::uint8_t{0}), unknown(size, std::uint8_t{0}), radius(size, 0.0F) {}

    void add(const PlanEstimate& plan, const Projected& projected, const std::uint32_t* corner) {
        std::array<cv::Point, 3> triangle;
        float largest = 0;
        bool is_known = true;
        for (std::size_t k = 0; k < triangle.size(); ++k) {
            const std::size_t vertex = corner[k];
            if (!projected.is_near(vertex)) return;
            triangle[k] =
                cv::Point(cvRound(projected.at[vertex].x), cvRound(projected.at[vertex].y));
            is_known = is_known && plan.status[vertex] != VertexStatus::unknown &&
                       std::isfinite(projected.radius[vertex]);
            largest = std::max(largest, projected.radius[vertex]);
        }
        cv::fillConvexPoly(is_known ? known : unknown, triangle.data(), 3, 255);
        if (!is_known) return;
        cv::fillConvexPoly(radius, triangle.data(), 3, largest);
        for (std::size_t k = 0; k < triangle.size(); ++k)
            squared_error += std::pow(double{plan.expected_error_mm[corner[k]]}, 2);
        corners += triangle.size();
    }
};

std::vector<OutlinePoint> outline_of(const std::vector<cv::Point>& contour, const PartMasks& masks,
                                     float scale) {
    std::vector<OutlinePoint> points;
    const cv::Size size = masks.known.size();
    for (std::size_t i = 0; i < contour.size(); i += kStep) {
        const cv::Point at = contour[i];
        points.push_back(
            {static_cast<float>(at.x) / scale, static_cast<float>(at.y) / scale,
             masks.radius(at) / scale, masks.unknown(at) != 0,
             at.x <= 0 || at.y <= 0 || at.x >= size.width - 1 || at.y >= size.height - 1});
    }
    return points;
}

}  // namespace

std::vector<PlanOutline> plan_outlines(const PlanEstimate& plan, const Projector& projector,
                                       int width, int height) {
    std::vector<PlanOutline> outlines;
    if (!plan.model || plan.vertices.empty() || width < 1 || height < 1) return outlines;
    const Projected projected(plan, projector, width, height);
    for (std::size_t p = 0; p < plan.model->parts.size(); ++p) {
        const PlanModel::Part& part = plan.model->parts[p];
        PartMasks masks(projected.size);
        for (std::size_t i = 0; i < part.triangle_count; ++i)
            masks.add(plan, projected, &plan.model->triangles[3 * (part.first_triangle + i)]);
        if (masks.corners == 0) continue;
        // Next to the edge counts as at it.
        cv::dilate(masks.unknown, masks.unknown, cv::Mat(), {-1, -1}, 2);
        std::vector<std::vector<cv::Point>> contours;
        cv::findContours(masks.known.clone(), contours, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
        PlanOutline outline;
        outline.part = p;
        outline.expected_error_mm =
            static_cast<float>(std::sqrt(masks.squared_error / static_cast<double>(masks.corners)));
        for (const std::vector<cv::Point>& contour : contours)
            if (contour.size() >= kFewestPoints)
                outline.contours.push_back(outline_of(contour, masks, projected.scale));
        if (!outline.contours.empty()) outlines.push_back(std::move(outline));
    }
    return outlines;
}

}  // namespace defrec::cli
