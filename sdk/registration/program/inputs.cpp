// See inputs.hpp.
#include "sdk/registration/program/inputs.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "sdk/base/util/utf8.hpp"
#include "sdk/io/csv.hpp"
#include "sdk/io/decisions.hpp"
#include "sdk/io/mesh_formats.hpp"
#include "sdk/io/ply_file.hpp"
#include "sdk/io/text.hpp"
#include "sdk/registration/program/decisions.hpp"

namespace defrec::cli {
namespace {

using decisions::RegisterInputs;

constexpr std::array<const char*, 3> kPlace = {"x", "y", "z"}, kNormal = {"nx", "ny", "nz"};
constexpr std::array<const char*, 6> kCovariance = {"xx", "xy", "xz", "yy", "yz", "zz"};
constexpr const char* kError = "expected_error_mm";

// Takes vertices one after the other, from whatever kind of file.
class SurfaceBuilder {
  public:
    // has: which columns there are.
    SurfaceBuilder(bool has_normals, bool has_covariances, bool has_errors)
        : has_normals_(has_normals),
          has_covariances_(has_covariances),
          has_errors_(has_errors && !has_covariances) {
        if (has_covariances_) file_.error_column = "xx..zz";
        if (has_errors_) file_.error_column = kError;
    }

    // number(name): a column's number. Returns what is wrong; empty: nothing.
    template <class Number>
    std::string add(const Number& number) {
        Eigen::Vector3d place;
        for (int axis = 0; axis < 3; ++axis)
            place[axis] = number(kPlace[static_cast<size_t>(axis)]);
        if (!place.allFinite()) return "has a coordinate that is not finite";
        if (has_covariances_) {
            for (const char* name : kCovariance) {
                const double value = number(name);
                if (!std::isfinite(value)) return "has a covariance that is not finite";
                file_.covariances.push_back(static_cast<float>(value));
            }
        } else if (has_errors_) {
            const double error = number(kError);
            if (!(error > 0) || !std::isfinite(error))
                return "has an expected error that is not positive and finite";
            add_error(place, error);
        }
        for (const double value : place) file_.places.push_back(static_cast<float>(value));
        if (has_normals_)
            for (const char* name : kNormal)
                file_.normals.push_back(static_cast<float>(number(name)));
        return {};
    }
    // left_out: vertices that were not added.
    SurfaceFile take(std::size_t left_out) {
        file_.left_out = left_out;
        return std::move(file_);
    }

  private:
    // Its root mean square, mostly along the line of sight.
    void add_error(const Eigen::Vector3d& place, double error) {
        const Eigen::Vector3d sight =
            place.isZero(0) ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : place.normalized();
        const double across = RegisterInputs::kAcrossShare;
        const Eigen::Matrix3d covariance =
            error * error *
            ((1 - 3 * across) * sight * sight.transpose() + across * Eigen::Matrix3d::Identity());
        for (const auto& [i, k] : {std::pair(0, 0), {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}})
            file_.covariances.push_back(static_cast<float>(covariance(i, k)));
    }

    bool has_normals_, has_covariances_, has_errors_;
    SurfaceFile file_;
};

template <std::size_t N, class Has>
bool has_all(const std::array<const char*, N>& names, const Has& has) {
    return std::all_of(names.begin(), names.end(), has);
}

SurfaceFile surface_of_ply(const PlyFile& ply, const std::string& name) {
    const auto has = [&](const char* column) { return ply.find(column) != nullptr; };
    if (!has_all(kPlace, has)) fail_mesh(name, "the vertices have no x, y and z.");
    SurfaceBuilder builder(has_all(kNormal, has), has_all(kCovariance, has), has(kError));
    const std::vector<double>* status = ply.find("status");
    std::size_t left_out = 0;
    for (std::size_t i = 0; i < ply.vertex_count; ++i) {
        if (status != nullptr && (*status)[i] != 0) {
            ++left_out;
            continue;
        }
        const std::string fault =
            builder.add([&](const char* column) { return (*ply.find(column))[i]; });
        if (!fault.empty()) fail_mesh(name, "vertex " + std::to_string(i) + " " + fault + ".");
    }
    return builder.take(left_out);
}

SurfaceFile surface_of_csv(const std::filesystem::path& path) {
    std::vector<std::string> optional;
    for (const char* name : kNormal) optional.emplace_back(name);
    for (const char* name : kCovariance) optional.emplace_back(name);
    optional.emplace_back(kError);
    optional.emplace_back("status");
    CsvReader csv(path, {kPlace.begin(), kPlace.end()}, optional);
    const auto column = [&](std::string_view name) -> std::size_t {
        for (std::size_t i = 0; i < 3; ++i)
            if (kPlace[i] == name) return i;
        return 3 + static_cast<std::size_t>(std::find(optional.begin(), optional.end(), name) -
                                            optional.begin());
    };
    const auto has = [&](const char* name) { return !csv.is_empty(column(name)); };
    std::optional<SurfaceBuilder> builder;
    std::size_t left_out = 0;
    while (csv.next()) {
        const std::string_view status = csv.field(column("status"));
        if (!status.empty() && status != "0" && status != "tracked") {
            ++left_out;
            continue;
        }
        // The first row that is kept says which columns are filled: those of a lost point are
        // empty.
        if (!builder)
            builder.emplace(has_all(kNormal, has), has_all(kCovariance, has), has(kError));
        const std::string fault =
            builder->add([&](const char* name) { return csv.number(column(name)); });
        if (!fault.empty()) csv.fail("the point " + fault + ".");
    }
    if (!builder)
        csv.fail(left_out == 0 ? "the file has no points." : "no point of the file was observed.");
    return builder->take(left_out);
}

// The nearest rigid motion, 3x4 row-major.
std::array<double, 12> checked_pose(const Eigen::Matrix<double, 3, 4>& rows,
                                    const std::string& name) {
    const Eigen::Matrix3d rotation = rows.leftCols<3>();
    const double off =
        (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!rows.allFinite() || !(off <= RegisterInputs::kMaxRotationError) ||
        rotation.determinant() < 0)
        fail_mesh(name, "the first three columns are no rotation: R R^T differs from 1 by " +
                            format_fixed(off, 4) + "; " +
                            format_fixed(RegisterInputs::kMaxRotationError, 4) +
                            " at most was expected, and a determinant of 1.");
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    std::array<double, 12> values{};
    Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> made(values.data());
    made.leftCols<3>() = svd.matrixU() * svd.matrixV().transpose();
    made.col(3) = rows.col(3);
    return values;
}

// xx, xy, xz, yy, yz, zz.
void add_isotropic(double variance, std::vector<double>& covariance) {
    covariance.insert(covariance.end(), {variance, 0, 0, variance, 0, variance});
}

}  // namespace

SurfaceFile read_surface_file(const std::filesystem::path& path) {
    if (path.extension() == ".csv") return surface_of_csv(path);
    const std::string bytes = read_file(path, decisions::MeshFiles::kMaxBytes, ExitCode::kInput);
    return surface_of_ply(read_ply(bytes, path.string()), path.string());
}

PairsFile PairsFile::those(const std::vector<std::uint8_t>& is_one) const {
    PairsFile made;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        if (is_one[i] == 0) continue;
        made.ids.push_back(ids[i]);
        const auto add = [i](const std::vector<double>& from, std::size_t width,
                             std::vector<double>& to) {
            const auto begin = from.begin() + static_cast<std::ptrdiff_t>(width * i);
            to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(width));
        };
        add(model_xyz, 3, made.model_xyz);
        add(seen_xyz, 3, made.seen_xyz);
        add(model_covariance, 6, made.model_covariance);
        add(seen_covariance, 6, made.seen_covariance);
    }
    return made;
}

PairsFile read_pairs_file(const std::filesystem::path& path) {
    CsvReader csv(path, {"id", "model_x", "model_y", "model_z", "x", "y", "z"},
                  {"error_mm", "model_error_mm"});
    PairsFile file;
    UniqueIds ids;
    const auto variance = [&](std::size_t column) {
        if (csv.is_empty(column)) return 0.0;
        const double error = csv.number(column);
        if (error < 0) csv.fail("an error of 0 mm or more was expected.");
        return error * error;
    };
    while (csv.next()) {
        file.ids.push_back(csv.integer(0));
        ids.add(csv, file.ids.back());
        for (std::size_t axis = 0; axis < 3; ++axis) {
            file.model_xyz.push_back(csv.number(1 + axis));
            file.seen_xyz.push_back(csv.number(4 + axis));
        }
        add_isotropic(variance(7), file.seen_covariance);
        add_isotropic(variance(8), file.model_covariance);
    }
    return file;
}

std::vector<ModelTarget> read_model_targets(const std::filesystem::path& path) {
    CsvReader csv(path, {"id", "x", "y", "z"}, {"name"});
    std::vector<ModelTarget> targets;
    UniqueIds ids;
    std::unordered_set<std::string> names;
    while (csv.next()) {
        if (targets.size() == RegisterInputs::kMaxTargets)
            csv.fail("at most " + std::to_string(RegisterInputs::kMaxTargets) +
                     " targets were expected.");
        ids.add(csv, csv.integer(0));
        const std::string name(csv.field(csv.is_empty(4) ? 0 : 4));
        if (!is_utf8(name)) csv.fail("the name of the target is not UTF-8.");
        if (!names.insert(name).second)
            csv.fail("another target is named \"" + name +
                     "\"; a target without a name has its id.");
        targets.push_back({name, {csv.number(1), csv.number(2), csv.number(3)}});
    }
    if (targets.empty()) csv.fail("the file names no target.");
    return targets;
}

PoseFile read_pose_file(const std::filesystem::path& path) {
    const std::string name = path.string();
    Eigen::Matrix<double, 3, 4> rows;
    if (path.extension() == ".json") {
        const auto json = nlohmann::json::parse(
            read_text_file(path, RegisterInputs::kMaxPoseBytes, ExitCode::kInput), nullptr, false);
        const auto at = json.is_object() ? json.find("transform") : json.end();
        const bool is_there =
            json.is_object() && at != json.end() && at->is_array() && at->size() >= 3;
        if (!is_there) fail_mesh(name, "a registration.json was expected, which has a transform.");
        for (int row = 0; row < 3; ++row)
            for (int column = 0; column < 4; ++column) {
                const auto& line = (*at)[static_cast<size_t>(row)];
                if (!line.is_array() || line.size() != 4 ||
                    !line[static_cast<size_t>(column)].is_number())
                    fail_mesh(name, "transform: rows of four numbers were expected.");
                rows(row, column) = line[static_cast<size_t>(column)].get<double>();
            }
        const auto verdict = json.find("verdict");
        return {checked_pose(rows, name), verdict != json.end() && verdict->is_string()
                                              ? verdict->get<std::string>()
                                              : std::string()};
    }
    CsvReader csv(path, {"x", "y", "z", "t"});
    for (int row = 0; row < 3; ++row) {
        if (!csv.next()) csv.fail("three rows of [R | t] were expected.");
        for (int column = 0; column < 4; ++column)
            rows(row, column) = csv.number(static_cast<size_t>(column));
    }
    if (csv.next() && !(csv.number(3) == 1 && csv.number(0) == 0))
        csv.fail("three rows of [R | t] were expected, or a fourth one 0, 0, 0, 1.");
    return {checked_pose(rows, name), {}};
}

}  // namespace defrec::cli
