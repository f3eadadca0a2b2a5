// JSON files of data sets.
#include "sdk/evaluation/data_sets/json_file.hpp"

#include <algorithm>

#include "sdk/io/text.hpp"

namespace defrec::cli {

using Json = nlohmann::json;
namespace fs = std::filesystem;

Json read_json_object(const fs::path& path, const std::string& what, ExitCode code) {
    constexpr std::size_t kLargestFile = 1'000'000'000;
    Json json = Json::parse(read_text_file(path, kLargestFile, code), nullptr, false);
    if (json.is_discarded() || !json.is_object())
        throw CliError(code, path.string() + ": JSON with " + what + " was expected.");
    return json;
}

std::vector<double> matrix_of(const fs::path& path, const Json& json, const std::string& name,
                              const std::vector<std::size_t>& counts, const std::string& shape) {
    std::vector<Json> items;
    const Json* source = json.contains(name) ? &json[name] : nullptr;
    if (source != nullptr && source->is_object() && source->contains("data"))
        source = &(*source)["data"];
    if (source != nullptr && source->is_array()) {
        for (const Json& item : *source) {
            if (item.is_array())
                items.insert(items.end(), item.begin(), item.end());
            else
                items.push_back(item);
        }
    }
    const bool is_matrix =
        source != nullptr &&
        std::find(counts.begin(), counts.end(), items.size()) != counts.end() &&
        std::all_of(items.begin(), items.end(), [](const Json& item) { return item.is_number(); });
    if (!is_matrix) {
        throw CliError(ExitCode::kCalibration,
                       path.string() + ": " + name + ", " + shape + ", was expected.");
    }
    std::vector<double> values;
    for (const Json& item : items) values.push_back(item.get<double>());
    return values;
}

CameraCalibration camera_of(const fs::path& path, const Json& json, const std::string& matrix,
                            const std::string& distortion) {
    const std::vector<double> m = matrix_of(path, json, matrix, {9}, "a 3x3 matrix of numbers");
    CameraCalibration camera;
    camera.fx = m[0];
    camera.cx = m[2];
    camera.fy = m[4];
    camera.cy = m[5];
    camera.distortion =
        matrix_of(path, json, distortion, {kDistortionLengths.begin(), kDistortionLengths.end()},
                  std::string(kDistortionLengthsText) + " coefficients of OpenCV");
    camera.matrix_origin = path.string() + ": " + matrix;
    camera.distortion_origin = path.string() + ": " + distortion;
    return camera;
}

void set_pose(const fs::path& path, const Json& json, const std::string& rotation,
              const std::string& translation, StereoCalibration& calibration) {
    const auto r = matrix_of(path, json, rotation, {9}, "a 3x3 matrix of numbers");
    const auto t = matrix_of(path, json, translation, {3}, "3 numbers, in m");
    std::copy(r.begin(), r.end(), calibration.rotation.begin());
    std::copy(t.begin(), t.end(), calibration.translation.begin());
    calibration.rotation_origin = path.string() + ": " + rotation;
    calibration.translation_origin = path.string() + ": " + translation;
}

}  // namespace defrec::cli
