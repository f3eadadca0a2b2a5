// The data of the page as JSON that may stand inside an HTML script element.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "sdk/report/key_frames.hpp"
#include "sdk/report/picture_gaps.hpp"
#include "sdk/report/point_history.hpp"
#include "sdk/report/report.hpp"
#include "sdk/report/surface_history.hpp"
#include "sdk/report/thinning.hpp"

namespace defrec::cli {

/// Little-endian bytes in base64 with padding.
std::string base64(const void* data, std::size_t bytes);

template <typename T>
std::string base64(const std::vector<T>& values) {
    return base64(values.data(), values.size() * sizeof(T));
}

nlohmann::json to_json(const ReportMeta& meta);
nlohmann::json to_json(const Series& series);
nlohmann::json to_json(const PictureGaps& gaps);
nlohmann::json to_json(const std::vector<KeyFrame>& pictures);

/// null where the user chose no points.
nlohmann::json to_json(const PointHistory& history);

/// texture_jpeg, width, height: the template's image; the surface carries it if not empty.
nlohmann::json to_json(const SurfaceHistory& history, const std::vector<std::uint8_t>& texture_jpeg,
                       int width, int height);

/// JSON text in which no character can end or comment out the script element; bytes that are not
/// UTF-8 are replaced.
std::string embeddable(const nlohmann::json& value);

}  // namespace defrec::cli
