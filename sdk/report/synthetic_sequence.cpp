// For tests: makes the sequence.
#include "sdk/report/synthetic_sequence.hpp"

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace defrec::cli::test {
namespace {

constexpr int kStep = 12;  // pixels of the template's image between vertices
constexpr double kDepth = 80;

cv::Mat tissue(int width, int height) {
    cv::RNG random(7);
    cv::Mat noise(height / 6 + 2, width / 6 + 2, CV_8UC1), large, fine(height, width, CV_8UC1),
        mixed, colour;
    random.fill(noise, cv::RNG::UNIFORM, 60, 200);
    cv::resize(noise, large, {width, height}, 0, 0, cv::INTER_CUBIC);
    random.fill(fine, cv::RNG::UNIFORM, 80, 170);
    cv::addWeighted(large, 0.7, fine, 0.3, 0, mixed);
    const cv::Mat channels[] = {0.45 * mixed, 0.5 * mixed, cv::Mat(60 + 0.8 * mixed)};
    cv::merge(channels, 3, colour);
    return colour;
}

void append(const cv::Vec3f& point, std::vector<float>& xyz) {
    xyz.insert(xyz.end(), {point[0], point[1], point[2]});
}

}  // namespace

SyntheticSequence::SyntheticSequence(int width, int height, int frames)
    : width_(width),
      height_(height),
      frames_(frames),
      columns_(width / kStep - 1),
      rows_(height / kStep - 1),
      focal_(1.05 * width),
      texture_(tissue(width, height)) {}

Projector SyntheticSequence::projector() const {
    return [f = focal_, cx = width_ / 2.0, cy = height_ / 2.0](const float* xyz, std::size_t count,
                                                               float* uv) {
        for (std::size_t i = 0; i < count; ++i) {
            const double z = double(xyz[3 * i + 2]);
            const bool valid = std::isfinite(z) && z > 1;
            constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
            uv[2 * i] = valid ? static_cast<float>(cx + f * double(xyz[3 * i]) / z) : kNan;
            uv[2 * i + 1] = valid ? static_cast<float>(cy + f * double(xyz[3 * i + 1]) / z) : kNan;
        }
    };
}

cv::Vec3f SyntheticSequence::point(int column, int row, int frame) const {
    const double u = (column + 1) * kStep, v = (row + 1) * kStep,
                 t = double(frame) / std::max(1, frames_ - 1);
    const double wave =
        std::sin(6.283 * (3 * t)) * std::exp(-std::pow((u - 0.55 * width_) / (0.3 * width_), 2) -
                                             std::pow((v - 0.5 * height_) / (0.4 * height_), 2));
    const double z = kDepth + 5 * std::cos(5 * u / width_) + 3 * std::sin(4 * v / height_);
    const double x = (u - width_ / 2.0) * z / focal_, y = (v - height_ / 2.0) * z / focal_;
    return cv::Vec3d(x + 3 * t + 0.8 * wave, y - 1.5 * t, z - 6 * wave);
}

bool SyntheticSequence::covered(const cv::Vec3f& at, int frame) const {
    const double t = double(frame) / frames_;
    return t > 0.2 && t < 0.45 && std::abs(double(at[0]) - 10) < 7 && at[1] > -12;
}

TemplateRecord SyntheticSequence::reference() const {
    TemplateRecord result;
    for (int row = 0; row < rows_; ++row)
        for (int column = 0; column < columns_; ++column)
            append(point(column, row, 0), result.vertices);
    result.vertex_uv.resize(result.vertices.size() / 3 * 2);
    projector()(result.vertices.data(), result.vertices.size() / 3, result.vertex_uv.data());
    for (int row = 0; row + 1 < rows_; ++row)
        for (int column = 0; column + 1 < columns_; ++column) {
            const auto a = static_cast<std::uint32_t>(row * columns_ + column), b = a + 1;
            const auto c = a + static_cast<std::uint32_t>(columns_), d = c + 1;
            result.triangles.insert(result.triangles.end(), {a, b, c, b, d, c});
        }
    return result;
}

cv::Mat SyntheticSequence::image(int frame) const {
    std::vector<float> now;
    for (int row = 0; row < rows_; ++row)
        for (int column = 0; column < columns_; ++column) append(point(column, row, frame), now);
    cv::Mat uv(rows_, columns_, CV_32FC2), shift(rows_, columns_, CV_32FC2), map, image;
    projector()(now.data(), now.size() / 3, uv.ptr<float>());
    for (int row = 0; row < rows_; ++row)
        for (int column = 0; column < columns_; ++column)
            shift.at<cv::Vec2f>(row, column) =
                cv::Vec2f(float((column + 1) * kStep), float((row + 1) * kStep)) -
                uv.at<cv::Vec2f>(row, column);
    cv::resize(shift, map, {width_, height_}, 0, 0, cv::INTER_LINEAR);
    for (int y = 0; y < height_; ++y)
        for (int x = 0; x < width_; ++x) map.at<cv::Vec2f>(y, x) += cv::Vec2f(float(x), float(y));
    cv::remap(texture_, image, map, cv::noArray(), cv::INTER_LINEAR, cv::BORDER_REFLECT);
    return image;
}

FrameRecord SyntheticSequence::record(int frame) const {
    FrameRecord result = facts(frame);
    if (result.state == "lost") {
        result.points = record(0).points;
        for (PointEstimate& point : result.points) point.status = VertexStatus::unknown;
        return result;
    }
    int observed = 0;
    for (int row = 0; row < rows_; ++row)
        for (int column = 0; column < columns_; ++column) {
            const Vertex vertex{column, row, point(column, row, frame)};
            const bool hidden = covered(vertex.at, frame);
            add_vertex(vertex, hidden, result);
            observed += result.vertex_status.back() == VertexStatus::observed;
            add_estimates(vertex, hidden, result);
            if (column % 6 == 3 && row % 6 == 3) append(vertex.at, result.control_points);
            if (column % 5 == 2 && row % 4 == 2) add_match(vertex, result);
        }
    result.observed_share = double(observed) / (rows_ * columns_);
    return result;
}

// The facts of the whole frame.
FrameRecord SyntheticSequence::facts(int frame) const {
    FrameRecord result;
    const double t = double(frame) / frames_;
    result.index = frame;
    result.timestamp_ms = frame * 40.0;
    result.features = 1000;
    result.stage_ms = {{"rectify", 0.6}, {"stereo", 5 + std::sin(frame)},
                       {"orb", 2.1},     {"match", 0.3},
                       {"lm", 2.0},      {"lm", 1.2}};
    result.frame_ms = 12 + std::sin(frame);
    result.rigid[3] = 3 * t;
    result.rigid[7] = -1.5 * t;
    result.state = frame == 0             ? "initialising"
                   : t >= 0.6 && t < 0.7  ? "lost"
                   : t >= 0.7 && t < 0.75 ? "relocalised"
                   : t >= 0.2 && t < 0.45 ? "degraded"
                                          : "tracking";
    const bool is_lost = result.state == "lost";
    result.reasons = is_lost ? "dark" : result.state == "degraded" ? "instrument-occlusion" : "";
    result.faulty_views = is_lost ? "both" : "";
    result.mean_residual_mm =
        is_lost ? std::numeric_limits<double>::quiet_NaN() : 0.2 + 0.1 * std::sin(9 * t);
    return result;
}

void SyntheticSequence::add_vertex(const Vertex& vertex, bool hidden, FrameRecord& result) const {
    const bool edge = vertex.column == 0 && vertex.row < rows_ / 3;
    append(vertex.at, result.vertices);
    result.vertex_status.push_back(edge     ? VertexStatus::unknown
                                   : hidden ? VertexStatus::extrapolated
                                            : VertexStatus::observed);
    result.expected_error_mm.push_back(hidden ? 1.4f : 0.3f);
}

// Points and targets at some of the vertices.
void SyntheticSequence::add_estimates(const Vertex& vertex, bool hidden,
                                      FrameRecord& result) const {
    const auto& [column, row, p] = vertex;
    const VertexStatus status = result.vertex_status.back();
    if (column % 7 == 2 && row % 7 == 2) {
        const float depth = hidden ? 1.6f : 0.08f;
        result.points.push_back({status,
                                 {p[0], p[1], p[2]},
                                 {0.01f, 0, 0.01f, 0.01f, 0, depth},
                                 row * columns_ + column,
                                 column == 2 && row == 2 ? "first" : "",
                                 true});
    }
    if (column % 9 == 4 && row % 9 == 4) {
        // 5, 10, 15 and 20 mm deep.
        const float depth = static_cast<float>(5 * (1 + (column / 9 + row / 9) % 4));
        TargetEstimate target;
        target.id = row * columns_ + column;
        target.depth = depth;
        target.status = status;
        target.xyz = {p[0], p[1], p[2] + depth};
        target.covariance = {0.01f * depth, 0, 0, 0.01f * depth, 0, 0.05f * depth};
        result.targets.push_back(target);
    }
}

void SyntheticSequence::add_match(const Vertex& vertex, FrameRecord& result) const {
    MatchSegment match;
    match.template_u = float((vertex.column + 1) * kStep);
    match.template_v = float((vertex.row + 1) * kStep);
    projector()(&vertex.at[0], 1, &match.live_u);
    match.inlier = (vertex.column + vertex.row) % 7 != 0;
    if (!match.inlier) match.live_u += 40;
    match.weight = match.inlier ? 1 : 0;
    ++result.matches;
    result.inliers += match.inlier;
    result.matched.push_back(match);
}

void SyntheticSequence::write_report(const std::filesystem::path& path,
                                     const ReportMeta& meta) const {
    ReportWriter report(path, meta, projector());
    for (int i = 0; i < frames_; ++i) {
        if (i == 1) report.set_template(reference(), image(0));
        report.add(image(i), record(i));
    }
    report.finish();
}

}  // namespace defrec::cli::test
