// The files of a scene with an elastic body.
#include "sdk/scenes/writing/body_files.hpp"

#include <cstdio>

#include "sdk/scenes/bodies/solid.hpp"

namespace defrec::cli {
namespace {

constexpr const char* kTargets = "targets.csv";
constexpr const char* kDeepTruth = "truth_deep.csv";
constexpr const char* kBody = "body.ply";
constexpr const char* kInclusion = "inclusion.ply";
constexpr const char* kHeld = "held.ply";
constexpr const char* kHeldMotion = "held_motion.csv";
constexpr double kMeshStep = 5.0;  // mm between the vertices of a box
constexpr double kBallStep = 1.5;  // and of a ball

}  // namespace

BodyFiles::BodyFiles(const std::filesystem::path& folder, const Film& film,
                     const Eigen::Matrix3d& rectification)
    : folder_(folder),
      film_(film),
      rectification_(rectification),
      deep_truth_(folder / kDeepTruth) {
    deep_truth_.write("frame,id,depth,x,y,z\n");
    if (film.scene().body->parts) {
        held_motion_.emplace(folder / kHeldMotion);
        held_motion_->write("frame,r11,r12,r13,tx,r21,r22,r23,ty,r31,r32,r33,tz\n");
    }
}

std::vector<std::string> BodyFiles::names() {
    return {kTargets, kDeepTruth, kBody, kInclusion, kHeld, kHeldMotion};
}

/// `id,depth,x,y,z` of a target in the present frame.
std::string BodyFiles::row_of(std::size_t target) const {
    const Film::Target& place = film_.targets()[target];
    const Eigen::Vector3d p = rectification_ * film_.truth(place);
    char line[120];
    std::snprintf(line, sizeof line, "%zu,%.1f,%.6f,%.6f,%.6f\n", target, kBodyDepths[place.layer],
                  p.x(), p.y(), p.z());
    return line;
}

/// From the scene at rest to the rectified camera, but for elastic displacement.
Eigen::Isometry3d BodyFiles::body_pose() const {
    return Eigen::Isometry3d(rectification_) * film_.body_pose();
}

void BodyFiles::write_first() const {
    std::string text = "id,depth,x,y,z\n";
    for (std::size_t id = 0; id < film_.targets().size(); ++id) text += row_of(id);
    write_atomically(folder_ / kTargets, text);
    const auto& parts = film_.scene().body->parts;
    if (!parts) {
        return;
    }
    const auto write_mesh = [&](const char* name, SolidMesh mesh) {
        for (Eigen::Vector3d& p : mesh.points) {
            p = first_pose_ * film_.scene().surface.rest(p.x(), p.y(), p.z());
        }
        write_atomically(folder_ / name, ply_of(mesh));
    };
    write_mesh(kBody, mesh_of(parts->whole, kMeshStep));
    write_mesh(kHeld, mesh_of(parts->held, kMeshStep));
    if (parts->inclusion) {
        write_mesh(kInclusion, mesh_of(*parts->inclusion, kBallStep));
    }
}

void BodyFiles::write(int frame) {
    if (frame == 0) {
        first_pose_ = body_pose();
        write_first();
    }
    for (std::size_t id = 0; id < film_.targets().size(); ++id) {
        deep_truth_.write(std::to_string(frame) + "," + row_of(id));
    }
    if (held_motion_) {
        const Eigen::Isometry3d moved = body_pose() * first_pose_.inverse();
        std::string row = std::to_string(frame);
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 4; ++j) {
                char number[32];
                std::snprintf(number, sizeof number, ",%.9f", moved(i, j));
                row += number;
            }
        }
        held_motion_->write(row + "\n");
    }
}

void BodyFiles::commit() {
    deep_truth_.commit();
    if (held_motion_) {
        held_motion_->commit();
    }
}

}  // namespace defrec::cli
