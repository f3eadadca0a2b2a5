// See register_picture.hpp.
#include "sdk/registration/program/register_picture.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/io/text.hpp"
#include "sdk/registration/program/register_json.hpp"

namespace defrec::cli {
namespace {

constexpr int kPanel = 560, kGap = 12, kLegend = 56;  // px

// Rows: to the right, downwards, and away from the viewer, in the frame that is seen.
struct View {
    const char* title;
    Eigen::Matrix3d axes;
};

std::array<View, 3> views() {
    std::array<View, 3> made{
        {{"as the camera sees it", {}}, {"from its right", {}}, {"from above", {}}}};
    made[0].axes << 1, 0, 0, 0, 1, 0, 0, 0, 1;
    made[1].axes << 0, 0, 1, 0, 1, 0, -1, 0, 0;
    made[2].axes << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    return made;
}

// Blue where the surface lies beneath the model's, white on it, red above.
cv::Scalar colour_of(double residual, double most) {
    const double share = std::clamp(residual / most, -1.0, 1.0);
    const double rest = 235 * (1 - std::abs(share)) + 20;
    return share > 0 ? cv::Scalar(rest, rest, 255) : cv::Scalar(255, rest, rest);
}

class Painter {
  public:
    Painter(const PictureInput& input, double most)
        : input_(input),
          most_(most),
          image_(kPanel + kLegend, 3 * kPanel + 2 * kGap, CV_8UC3, cv::Scalar(255, 255, 255)) {
        for (std::size_t i = 0; i + 2 < input.model_xyz.size(); i += 3)
            model_.emplace_back(Eigen::Map<const Eigen::Vector3d>(&input.model_xyz[i]));
        for (std::size_t i = 0; i + 2 < input.places.size(); i += 3)
            places_.push_back(Eigen::Map<const Eigen::Vector3f>(&input.places[i]).cast<double>());
    }

    cv::Mat paint() {
        int panel = 0;
        for (const View& view : views()) {
            fit(view);
            cv::Mat part = image_(cv::Rect(panel * (kPanel + kGap), 0, kPanel, kPanel));
            paint_model(view, part);
            paint_points(view, part);
            cv::rectangle(part, {0, 0}, {kPanel - 1, kPanel - 1}, {200, 200, 200});
            write(part, view.title, {8, 20});
            ++panel;
        }
        paint_legend();
        return image_;
    }

  private:
    static void write(cv::Mat& image, const std::string& text, cv::Point at) {
        cv::putText(image, text, at, cv::FONT_HERSHEY_SIMPLEX, 0.5, {40, 40, 40}, 1, cv::LINE_AA);
    }

    // Model and points fill the panel.
    void fit(const View& view) {
        Eigen::Vector3d low = view.axes * places_.front(), high = low;
        const auto include = [&](const Eigen::Vector3d& place) {
            low = low.cwiseMin(view.axes * place);
            high = high.cwiseMax(view.axes * place);
        };
        const std::size_t corners = 3 * input_.registration->triangle_count;
        for (std::size_t i = 0; i < corners; ++i)
            include(model_[input_.registration->triangles[i]]);
        for (const Eigen::Vector3d& place : places_) include(place);
        const double size = std::max((high - low).head<2>().maxCoeff(), 1.0);
        scale_ = 0.92 * kPanel / size;
        offset_ = Eigen::Vector2d::Constant(kPanel / 2.0) - scale_ * ((high + low) / 2).head<2>();
    }
    cv::Point pixel(const View& view, const Eigen::Vector3d& place) const {
        const Eigen::Vector2d at = scale_ * (view.axes * place).head<2>() + offset_;
        return {static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y()))};
    }

    // From behind to the front.
    void paint_model(const View& view, cv::Mat& part) const {
        const std::size_t count = input_.registration->triangle_count;
        const auto corner = [&](std::size_t triangle, std::size_t i) -> const Eigen::Vector3d& {
            return model_[input_.registration->triangles[3 * triangle + i]];
        };
        std::vector<double> depth(count);
        std::vector<std::uint32_t> order(count);
        std::iota(order.begin(), order.end(), 0u);
        for (std::size_t i = 0; i < count; ++i)
            depth[i] = view.axes.row(2).dot(corner(i, 0) + corner(i, 1) + corner(i, 2));
        std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
            return depth[a] != depth[b] ? depth[a] > depth[b] : a < b;
        });
        for (const std::uint32_t i : order) {
            const Eigen::Vector3d normal =
                (corner(i, 1) - corner(i, 0)).cross(corner(i, 2) - corner(i, 0)).normalized();
            const double light = std::abs(view.axes.row(2).dot(normal));
            const double gray = 130 + 90 * light;
            const std::array<cv::Point, 3> corners{
                pixel(view, corner(i, 0)), pixel(view, corner(i, 1)), pixel(view, corner(i, 2))};
            cv::fillConvexPoly(part, corners.data(), 3, cv::Scalar(gray, gray, gray));
        }
    }

    void paint_points(const View& view, cv::Mat& part) const {
        const defrec_registration_info& registration = *input_.registration;
        for (std::size_t i = 0; i < places_.size(); ++i) {
            const double residual = registration.residuals[i];
            const bool is_inlier = registration.inliers[i] != 0 && std::isfinite(residual);
            cv::circle(part, pixel(view, places_[i]), 2,
                       is_inlier ? colour_of(residual, most_) : cv::Scalar(0, 0, 0), cv::FILLED,
                       cv::LINE_AA);
        }
    }

    void paint_legend() {
        constexpr int kBar = 300, kTop = kPanel + 26;
        for (int x = 0; x < kBar; ++x)
            cv::line(image_, {x + 70, kTop}, {x + 70, kTop + 14},
                     colour_of((2.0 * x / (kBar - 1) - 1) * most_, most_));
        write(image_, format_fixed(-most_, 1), {22, kTop + 12});
        write(image_, format_fixed(most_, 1) + " mm above the model; black: outliers",
              {76 + kBar, kTop + 12});
        const defrec_registration_info& registration = *input_.registration;
        write(image_,
              std::string(input_.verdict) +
                  (registration.deformation == DEFREC_DEFORMATION_APPLIED ? ", deformed" : "") +
                  ", rms " + format_fixed(registration.rms_mm, 2) + " mm, " +
                  format_fixed(100 * registration.inlier_share, 0) + " % inliers",
              {kPanel + 250, kTop + 12});
    }

    const PictureInput& input_;
    double most_;  // mm, of the colours
    cv::Mat image_;
    std::vector<Eigen::Vector3d> model_, places_;
    double scale_ = 1;
    Eigen::Vector2d offset_ = Eigen::Vector2d::Zero();
};

}  // namespace

void write_register_picture(const std::filesystem::path& path, const PictureInput& input) {
    const double most = std::max(0.5, 3 * input.registration->rms_mm);
    std::vector<unsigned char> bytes;
    cv::imencode(".png", Painter(input, most).paint(), bytes);
    write_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace defrec::cli
