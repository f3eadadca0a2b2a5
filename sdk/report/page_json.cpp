// The data of the page as JSON; web/data.js reads it.
#include "sdk/report/page_json.hpp"

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "sdk/report/ellipsoid.hpp"

namespace defrec::cli {
namespace {

using nlohmann::json;

static_assert(std::endian::native == std::endian::little, "the page reads little-endian arrays");

json number_or_null(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json to_json(const QuantisedPoints& points) {
    return {{"lowest", points.lowest}, {"step", points.step}, {"xyz", base64(points.xyz)}};
}

json to_json(const Ellipsoids& ellipsoids) {
    return {{"points", to_json(ellipsoids.points)},
            {"shapes", base64(ellipsoids.shapes)},
            {"status", base64(ellipsoids.status)}};
}

const char* name_of(ReportSeverity severity) {
    return severity == ReportSeverity::error     ? "error"
           : severity == ReportSeverity::warning ? "warning"
                                                 : "remark";
}

json targets_json(const SurfaceHistory& history) {
    if (history.target_labels().empty()) return nullptr;
    json labels = json::array();
    for (const TargetLabel& label : history.target_labels())
        labels.push_back({{"id", label.id}, {"depth", number_or_null(double{label.depth})}});
    return {{"count", history.target_count()}, {"labels", labels}};
}

json to_json(const LightPlan& plan) {
    if (plan.is_empty()) return nullptr;
    json parts = json::array();
    for (const PlanModel::Part& part : plan.parts())
        parts.push_back(
            {{"name", part.name}, {"first", part.first_triangle}, {"count", part.triangle_count}});
    return {{"triangles", base64(plan.triangles())}, {"parts", parts}};
}

json to_json(const SurfaceMoment& moment) {
    json result{{"frame", moment.frame},
                {"ms", moment.timestamp_ms},
                {"state", moment.state},
                {"reasons", moment.reasons},
                {"residual_mm", number_or_null(moment.mean_residual_mm)},
                {"rigid", moment.rigid}};
    if (moment.points.xyz.empty()) return result;
    result["points"] = to_json(moment.points);
    result["status"] = base64(moment.status);
    if (!moment.error.empty()) result["error"] = base64(moment.error);
    if (!moment.ellipsoids.status.empty()) result["ellipsoids"] = to_json(moment.ellipsoids);
    if (!moment.targets.status.empty()) result["targets"] = to_json(moment.targets);
    if (!moment.plan.xyz.empty()) {
        result["plan"] = to_json(moment.plan);
        result["plan_error"] = base64(moment.plan_error);
    }
    if (!moment.plan_targets.status.empty()) result["plan_targets"] = to_json(moment.plan_targets);
    return result;
}

}  // namespace

std::string base64(const void* data, std::size_t bytes) {
    static constexpr char kDigits[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const auto* in = static_cast<const unsigned char*>(data);
    std::string out;
    out.reserve((bytes + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes; i += 3) {
        const std::size_t left = bytes - i;
        const unsigned word = unsigned{in[i]} << 16 | (left > 1 ? unsigned{in[i + 1]} << 8 : 0u) |
                              (left > 2 ? unsigned{in[i + 2]} : 0u);
        out += kDigits[word >> 18];
        out += kDigits[word >> 12 & 63];
        out += left > 1 ? kDigits[word >> 6 & 63] : '=';
        out += left > 2 ? kDigits[word & 63] : '=';
    }
    return out;
}

json to_json(const ReportMeta& meta) {
    json facts = json::array();
    for (const auto& [name, value] : meta.facts) facts.push_back({name, value});
    json notes = json::array();
    for (const ReportSeverity severity :
         {ReportSeverity::error, ReportSeverity::warning, ReportSeverity::remark})
        for (const ReportNote& note : meta.notes)
            if (note.severity == severity)
                notes.push_back({{"severity", name_of(severity)}, {"text", note.text}});
    return {{"sequence", meta.sequence},        {"backend", meta.backend}, {"device", meta.device},
            {"version", meta.version},          {"facts", facts},          {"notes", notes},
            {"overlay_file", meta.overlay_file}};
}

json to_json(const Series& series) {
    json lines = json::array();
    for (const Series::Line& line : series.lines())
        lines.push_back({{"name", line.name}, {"values", base64(line.values)}});
    return {{"stride", series.stride()},
            {"frames", series.frames()},
            {"ms", base64(series.timestamps_ms())},
            {"lines", lines}};
}

json to_json(const PictureGaps& gaps) {
    json listed = json::array();
    for (const PictureGaps::Gap& gap : gaps.listed())
        listed.push_back({{"from_ms", gap.from_ms}, {"to_ms", gap.to_ms}});
    return {{"listed", listed}, {"count", gaps.count()}, {"total_ms", gaps.total_ms()}};
}

json to_json(const std::vector<KeyFrame>& pictures) {
    json result = json::array();
    for (const KeyFrame& picture : pictures)
        result.push_back({{"frame", picture.frame},
                          {"ms", picture.timestamp_ms},
                          {"state", picture.state},
                          {"reasons", picture.reasons},
                          {"faulty_views", picture.faulty_views},
                          {"changed", picture.state_changed},
                          {"jpeg", base64(picture.jpeg)}});
    return result;
}

json to_json(const PointHistory& history) {
    if (history.listed().empty()) return nullptr;
    json listed = json::array(), moments = json::array();
    for (const PointFacts& point : history.listed())
        listed.push_back({{"id", point.id},
                          {"name", point.name},
                          {"first_frame", point.first_frame},
                          {"frames", point.frames},
                          {"median_mm", number_or_null(point.error_mm.quantile(0.5))},
                          {"largest_mm", point.largest_mm}});
    for (const PointMoment& moment : history.moments().items())
        moments.push_back({{"frame", moment.frame},
                           {"ms", moment.timestamp_ms},
                           {"status", base64(moment.status)},
                           {"points", to_json(moment.points)},
                           {"uv", base64(moment.uv)},
                           {"error", base64(moment.error)},
                           {"largest", base64(moment.largest)}});
    return {{"count", history.count()},
            {"listed", listed},
            {"pixel_step", kPixelStep},
            {"error_step_mm", kPointErrorStepMm},
            {"stride", history.moments().stride()},
            {"moments", moments}};
}

json to_json(const SurfaceHistory& history, const std::vector<std::uint8_t>& texture_jpeg,
             int width, int height) {
    if (history.lattice().size() == 0) return nullptr;
    std::vector<float> texture_uv;
    if (!texture_jpeg.empty()) {
        texture_uv = history.lattice().uv();
        for (std::size_t i = 0; i + 1 < texture_uv.size(); i += 2) {
            texture_uv[i] = (texture_uv[i] + 0.5f) / static_cast<float>(width);
            texture_uv[i + 1] = 1 - (texture_uv[i + 1] + 0.5f) / static_cast<float>(height);
        }
    }
    json moments = json::array();
    for (const SurfaceMoment& moment : history.moments().items())
        moments.push_back(to_json(moment));
    return {{"triangles", base64(history.lattice().triangles())},
            {"rest", to_json(history.rest())},
            {"texture", base64(texture_jpeg)},
            {"texture_uv", base64(texture_uv)},
            {"error_step_mm", kErrorStepMm},
            {"shape_step_mm", kShapeStepMm},
            {"targets", targets_json(history)},
            {"plan", to_json(history.plan())},
            {"stride", history.moments().stride()},
            {"moments", moments}};
}

std::string embeddable(const json& value) {
    const std::string text = value.dump(-1, ' ', true, json::error_handler_t::replace);
    std::string out;
    out.reserve(text.size() + 64);
    for (const char c : text) {
        if (c == '<')
            out += "\\u003c";
        else if (c == '>')
            out += "\\u003e";
        else if (c == '&')
            out += "\\u0026";
        else
            out += c;
    }
    return out;
}

}  // namespace defrec::cli
