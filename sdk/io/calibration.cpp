// Reads OpenCV stereo YAML and pairs of ROS camera_info files. What the numbers must satisfy is in
// calibration_check.cpp.
#include "sdk/io/calibration.hpp"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "sdk/io/decisions.hpp"
#include "sdk/io/ros_calibration.hpp"
#include "sdk/io/text.hpp"
#include "sdk/io/yaml_document.hpp"

namespace defrec::cli {
namespace {

using Limits = decisions::CalibrationFile;

struct Matrix {
    int rows = 0, cols = 0;
    std::vector<double> values;  // row-major
    std::string origin;
};

struct Shape {
    int rows, cols;
};

std::string shape_text(int rows, int cols) {
    return std::to_string(rows) + "x" + std::to_string(cols);
}

const YamlEntry& require_entry(const YamlDocument& document, const std::string& key) {
    const YamlEntry* entry = document.root().find(key);
    if (entry == nullptr) document.fail(1, key, "this key is missing.");
    return *entry;
}

// names: of the same value, the usual one first.
const YamlEntry* find_one_of(const YamlDocument& document, const std::vector<std::string>& names) {
    const YamlEntry* found = nullptr;
    for (const std::string& name : names) {
        const YamlEntry* entry = document.root().find(name);
        if (entry != nullptr && found != nullptr)
            document.fail(entry->line, name,
                          found->key + " gives the same value; keep one of the two.");
        if (entry != nullptr) found = entry;
    }
    return found;
}

// The shape that a `{rows, cols, dt, data}` map declares, checked before a number of its data is
// read.
Shape declared_shape(const YamlDocument& document, const YamlEntry& entry) {
    document.require_known_keys(entry.value, {"rows", "cols", "dt", "data"}, entry.key + ".");
    const YamlEntry* rows = entry.value.find("rows");
    const YamlEntry* cols = entry.value.find("cols");
    if (rows == nullptr || cols == nullptr)
        document.fail(entry.line, entry.key, "rows and cols must be given.");
    if (const YamlEntry* dt = entry.value.find("dt")) {
        const std::string& type = dt->value.scalar;
        if (type != "d" && type != "f" && type != "i") {
            document.fail(dt->line, entry.key + ".dt",
                          "d, f or i was expected, not '" + type.substr(0, 20) + "'.");
        }
    }
    return {document.integer(rows->value, entry.key + ".rows", 0, Limits::kMaxImageSide),
            document.integer(cols->value, entry.key + ".cols", 0, Limits::kMaxImageSide)};
}

// The matrix under `entry`, as OpenCV's `{rows, cols, dt, data}` or as a plain list; one of
// `allowed` in shape.
Matrix read_matrix(const YamlDocument& document, const YamlEntry& entry,
                   const std::vector<Shape>& allowed) {
    const YamlNode* data = &entry.value;
    Shape shape{0, 0};
    if (entry.value.kind == YamlNode::Kind::kMap) {
        shape = declared_shape(document, entry);
        const YamlEntry* inner = entry.value.find("data");
        if (inner == nullptr) document.fail(entry.line, entry.key, "data must be given.");
        data = &inner->value;
    }
    const bool is_empty_list = data->kind == YamlNode::Kind::kNull;
    if (data->kind != YamlNode::Kind::kSequence && !is_empty_list) {
        document.fail(data->line, entry.key, "a matrix (rows, cols, data: [...]) was expected.");
    }
    const int count = static_cast<int>(data->items.size());
    if (entry.value.kind != YamlNode::Kind::kMap) {
        const auto fits = std::find_if(allowed.begin(), allowed.end(),
                                       [&](const Shape& s) { return s.rows * s.cols == count; });
        shape = fits != allowed.end() ? *fits : Shape{1, count};
    }
    const bool is_allowed = std::any_of(allowed.begin(), allowed.end(), [&](const Shape& s) {
        return s.rows == shape.rows && s.cols == shape.cols;
    });
    if (!is_allowed) {
        std::string wanted;
        for (const Shape& s : allowed)
            wanted += (wanted.empty() ? "" : ", ") + shape_text(s.rows, s.cols);
        document.fail(
            entry.line, entry.key,
            "the matrix is " + shape_text(shape.rows, shape.cols) + "; expected: " + wanted + ".");
    }
    if (count != shape.rows * shape.cols) {
        document.fail(data->line, entry.key,
                      "data holds " + std::to_string(count) + " numbers; rows and cols ask for " +
                          std::to_string(shape.rows * shape.cols) + ".");
    }
    Matrix matrix{shape.rows, shape.cols, {}, {}};
    for (const YamlNode& item : data->items)
        matrix.values.push_back(document.number(item, entry.key));
    matrix.origin = document.path() + ":" + std::to_string(entry.line) + ": " + entry.key;
    return matrix;
}

// Row 9's lengths, lying or standing. A wrong length is reported as such and not as a wrong shape.
Matrix read_distortion(const YamlDocument& document, const YamlEntry& entry) {
    std::vector<Shape> allowed;
    for (const std::size_t length : kDistortionLengths) {
        allowed.push_back({1, static_cast<int>(length)});
        allowed.push_back({static_cast<int>(length), 1});
    }
    allowed.push_back({0, 0});
    if (entry.value.kind == YamlNode::Kind::kMap) {
        const Shape shape = declared_shape(document, entry);
        const bool is_vector = shape.rows <= 1 || shape.cols <= 1;
        const bool is_known = std::any_of(allowed.begin(), allowed.end(), [&](const Shape& s) {
            return s.rows == shape.rows && s.cols == shape.cols;
        });
        if (!is_vector || !is_known) {
            document.fail(entry.line, entry.key,
                          "the distortion is " + shape_text(shape.rows, shape.cols) +
                              "; OpenCV's models have " + kDistortionLengthsText +
                              " coefficients in one row or column.");
        }
    } else if (entry.value.kind == YamlNode::Kind::kSequence) {
        const std::string fault = fault_of_distortion(entry.value.items.size());
        if (!fault.empty()) document.fail(entry.line, entry.key, fault);
    }
    return read_matrix(document, entry, allowed);
}

void set_matrix(const YamlDocument& document, const YamlEntry& entry, CameraCalibration& camera) {
    const Matrix matrix = read_matrix(document, entry, {{3, 3}});
    set_camera_matrix(matrix.values, matrix.origin, camera);
}

void set_distortion(const YamlDocument& document, const YamlEntry* entry,
                    CameraCalibration& camera) {
    if (entry == nullptr) return;
    const Matrix matrix = read_distortion(document, *entry);
    camera.distortion = matrix.values;
    camera.distortion_origin = matrix.origin;
}

// calibration: of a rig, or of a camera.
template <class Calibration>
void set_size(const YamlDocument& document, Calibration& calibration) {
    const YamlEntry* width = document.root().find("image_width");
    const YamlEntry* height = document.root().find("image_height");
    if (width == nullptr && height == nullptr) return;
    if (width == nullptr || height == nullptr) {
        const YamlEntry* given = width != nullptr ? width : height;
        document.fail(given->line, given->key,
                      "image_width and image_height belong together; one is missing.");
    }
    calibration.width = document.integer(width->value, "image_width", 1, Limits::kMaxImageSide);
    calibration.height = document.integer(height->value, "image_height", 1, Limits::kMaxImageSide);
    calibration.size_origin = document.path() + ":" + std::to_string(width->line) + ": image_width";
}

constexpr const char* kExpected =
    "OpenCV's stereo YAML with M1 D1 M2 D2 R T was expected, or camera_info files of ROS, "
    "left.yaml,right.yaml or the folder that holds both.";

// A file of another kind is told as such, instead of the first of its keys.
void refuse_other_kinds(const YamlDocument& document, const std::vector<std::string>& known) {
    const YamlNode& root = document.root();
    if (std::any_of(known.begin(), known.end(),
                    [&](const std::string& key) { return root.find(key) != nullptr; }))
        return;
    const bool is_summary =
        root.find("rectified_camera") != nullptr && root.find("options") != nullptr;
    document.fail(1, {},
                  (is_summary ? "this is the summary of a run of defrec track, whose options name "
                                "the calibration; "
                              : "this is no calibration, none of its keys is there; ") +
                      std::string(kExpected));
}

YamlDocument load_document(const std::string& file) {
    try {
        return YamlDocument::load(file, ExitCode::kCalibration);
    } catch (const CliError& error) {
        std::error_code ignored;
        if (!std::filesystem::is_regular_file(file, ignored)) throw;
        throw CliError(error.code(), std::string(error.what()) + " " + kExpected);
    }
}

struct CameraKeys {
    CameraCalibration* camera;
    std::vector<std::string> matrix, distortion;  // names of the same, the usual one first
};

StereoCalibration read_opencv(const YamlDocument& document) {
    // After the keys that are used, what cv::stereoCalibrate's sample and SCARED write beside them.
    static const std::vector<std::string> kKnown = {"M1",
                                                    "M2",
                                                    "K1",
                                                    "K2",
                                                    "cameraMatrix1",
                                                    "cameraMatrix2",
                                                    "D1",
                                                    "D2",
                                                    "distCoeffs1",
                                                    "distCoeffs2",
                                                    "R",
                                                    "T",
                                                    "image_width",
                                                    "image_height",  //
                                                    "R1",
                                                    "R2",
                                                    "P1",
                                                    "P2",
                                                    "Q",
                                                    "E",
                                                    "F",
                                                    "calibration_time",
                                                    "nframes",
                                                    "nr_of_frames",
                                                    "board_width",
                                                    "board_height",
                                                    "square_size",
                                                    "flags",
                                                    "rms",
                                                    "avg_reprojection_error"};
    if (document.root().find("camera_matrix") != nullptr)
        document.fail(1, {}, "this is the camera_info of one camera; " + std::string(kExpected));
    refuse_other_kinds(document, kKnown);
    document.require_known_keys(document.root(), kKnown);

    StereoCalibration calibration;
    for (const auto& [camera, matrix, distortion] : {
             CameraKeys{&calibration.left, {"M1", "K1", "cameraMatrix1"}, {"D1", "distCoeffs1"}},
             CameraKeys{&calibration.right, {"M2", "K2", "cameraMatrix2"}, {"D2", "distCoeffs2"}},
         }) {
        const YamlEntry* entry = find_one_of(document, matrix);
        if (entry == nullptr) document.fail(1, matrix.front(), "this key is missing.");
        set_matrix(document, *entry, *camera);
        set_distortion(document, find_one_of(document, distortion), *camera);
    }
    const Matrix rotation = read_matrix(document, require_entry(document, "R"), {{3, 3}});
    const Matrix translation =
        read_matrix(document, require_entry(document, "T"), {{3, 1}, {1, 3}});
    std::copy(rotation.values.begin(), rotation.values.end(), calibration.rotation.begin());
    std::copy(translation.values.begin(), translation.values.end(),
              calibration.translation.begin());
    calibration.rotation_origin = rotation.origin;
    calibration.translation_origin = translation.origin;
    set_size(document, calibration);
    return calibration;
}

RosCamera read_ros_camera(const YamlDocument& document) {
    // The files of camera_info_manager, and a dumped message's names in ROS 1 and ROS 2.
    static const std::vector<std::string> kKnown = {"image_width",
                                                    "image_height",
                                                    "camera_name",
                                                    "camera_matrix",
                                                    "distortion_model",
                                                    "distortion_coefficients",
                                                    "rectification_matrix",
                                                    "projection_matrix",
                                                    "header",
                                                    "width",
                                                    "height",
                                                    "K",
                                                    "D",
                                                    "R",
                                                    "P",
                                                    "k",
                                                    "d",
                                                    "r",
                                                    "p",
                                                    "binning_x",
                                                    "binning_y",
                                                    "roi"};
    refuse_other_kinds(document, kKnown);
    document.require_known_keys(document.root(), kKnown);
    const auto find = [&](const std::string& name, const std::string& upper,
                          const std::string& lower) {
        return find_one_of(document, {name, upper, lower});
    };
    if (const YamlEntry* model = document.root().find("distortion_model"))
        check_distortion_model(
            model->value.scalar,
            document.path() + ":" + std::to_string(model->line) + ": distortion_model");
    RosCamera ros;
    const YamlEntry* matrix = find("camera_matrix", "K", "k");
    if (matrix == nullptr) document.fail(1, "camera_matrix", "this key is missing.");
    set_matrix(document, *matrix, ros.camera);
    set_distortion(document, find("distortion_coefficients", "D", "d"), ros.camera);
    if (const YamlEntry* entry = find("rectification_matrix", "R", "r")) {
        const Matrix rectification = read_matrix(document, *entry, {{3, 3}});
        std::copy(rectification.values.begin(), rectification.values.end(),
                  ros.rectification.begin());
        ros.rectification_origin = rectification.origin;
    }
    const YamlEntry* entry = find("projection_matrix", "P", "p");
    if (entry == nullptr) document.fail(1, "projection_matrix", "this key is missing.");
    const Matrix projection = read_matrix(document, *entry, {{3, 4}});
    std::copy(projection.values.begin(), projection.values.end(), ros.projection.begin());
    ros.projection_origin = projection.origin;
    set_size(document, ros);
    return ros;
}

// A calibration as it is written. files_unit: on return the unit that its format prescribes.
StereoCalibration read_files(const std::string& source, LengthUnit& files_unit) {
    namespace fs = std::filesystem;
    std::error_code error;
    std::string left, right;
    if (fs::is_directory(source, error)) {
        left = (fs::path(source) / "left.yaml").string();
        right = (fs::path(source) / "right.yaml").string();
    } else if (!fs::exists(source, error) && source.find(',') != std::string::npos) {
        const std::vector<std::string_view> parts = split(source, ',');
        if (parts.size() != 2 || parts[0].empty() || parts[1].empty()) {
            throw CliError(ExitCode::kCalibration,
                           source + ": two files were expected: left.yaml,right.yaml.");
        }
        left = parts[0];
        right = parts[1];
    }
    files_unit = left.empty() ? LengthUnit::kMillimetre : LengthUnit::kMetre;
    if (left.empty()) return read_opencv(load_document(source));
    const RosCamera left_camera = read_ros_camera(load_document(left));
    return rig_of(left_camera, read_ros_camera(load_document(right)));
}

}  // namespace

WrittenCalibration written_calibration(const std::string& source) {
    WrittenCalibration written;
    written.values = read_files(source, written.unit);
    return written;
}

StereoCalibration load_calibration(const WrittenCalibration& written, LengthUnit unit) {
    StereoCalibration calibration = written.values;
    detail::check_and_normalise(calibration, unit, written.unit);
    if (calibration.width > 0) fit_to_frames(calibration, calibration.width, calibration.height);
    return calibration;
}

StereoCalibration load_calibration(const std::string& source, LengthUnit unit) {
    return load_calibration(written_calibration(source), unit);
}

StereoCalibration read_calibration(WrittenCalibration written, LengthUnit unit) {
    detail::turn_into_millimetres(written.values, unit, written.unit);
    return std::move(written.values);
}

}  // namespace defrec::cli
