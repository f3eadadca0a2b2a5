// A scene, filmed.
#include "sdk/scenes/film.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "sdk/scenes/intersect.hpp"
#include "sdk/scenes/noise.hpp"
#include "sdk/scenes/sheet.hpp"

namespace defrec::cli {
namespace {

constexpr double kFloorHalfWidth = 6.0;  // mm of texture across the floor of a cut
constexpr double kFloorSpacing = 0.25;
constexpr std::uint8_t kFloorMesh = 2;   // of a cut: the first two are its sides
constexpr double kBesideCut = 0.5;       // mm
constexpr double kOcclusionSlack = 0.3;  // mm, between a point and the mesh in front of it
constexpr int kExposures = 8;            // of a picture with motion blur: steps of a pixel or two

bool hidden_by(const Blood& blood, const Eigen::Vector2f& material) {
    return blood_cover(blood_inside(blood, material.x(), material.y())) > 0.5f;
}

/// Places beneath the view, 6 mm apart and 7 mm.
std::vector<Film::Target> targets_in(const Body& body) {
    std::vector<Film::Target> targets;
    for (std::size_t layer = 0; layer < body.layers; ++layer) {
        for (int j = -2; j <= 2; ++j) {
            for (int i = -4; i <= 4; ++i) {
                targets.push_back({{6.0 * i, 7.0 * j}, layer});
            }
        }
    }
    return targets;
}

/// Whether a point lies within half a millimetre of a cut or of another lobe.
bool beside_line(const Motion& motion, const Eigen::Vector2d& material) {
    if (std::abs(material.y()) >= kBesideCut) {
        return false;
    }
    const double half_length = motion.incision.half_length;
    return motion.lobes.step != 0 ||
           (half_length > 0 && std::abs(material.x()) < half_length + kBesideCut);
}

}  // namespace

Film::Film(const std::string& scene, int width, int height, int frames, std::uint64_t seed,
           int threads, const std::vector<SceneSetting>& settings)
    : width_(width),
      height_(height),
      threads_(threads),
      scene_(make_scene(scene, width, height, frames, seed, settings)),
      left_{View(scene_.rig.left, width, height, threads)},
      right_{View(scene_.rig.right, width, height, threads)},
      painter_(threads) {
    if (scene_.sheets.empty()) {
        prepare_meshes();
    } else {
        prepare_sheets();
    }
    if (scene_.body) {
        targets_ = targets_in(*scene_.body);
    }
}

void Film::advance(double step) {
    if (++frame_ > 0) {
        time_ += step;
    }
    const FrameState next = scene_.at(time_);
    if (next.repeats_previous) {
        return;
    }
    state_ = next;
    misalign_right();
    place_views(state_);
    deform_meshes(state_, {&left_.view, &right_.view});
    raster_.render(meshes_, left_.view, threads_, left_.hits);
    raster_.render(meshes_, right_.view, threads_, right_.hits);
    photograph(true);
    photograph(false);
    place_views(state_);
    if (frame_ == 0) {
        choose_points();
    }
}

Film::Truth Film::truth(std::size_t point) const {
    const Followed& followed = points_[point];
    const Eigen::Vector3d in_left = left_.view.from_scene(
        formula_of(state_, followed.mesh)(followed.material.x(), followed.material.y()));
    return {in_left, visible(followed, in_left)};
}

Eigen::Vector3d Film::truth(const Target& target) const {
    return left_.view.from_scene(scene_.surface.beneath(target.material.x(), target.material.y(),
                                                        target.layer, *state_.motion.body));
}

Eigen::Isometry3d Film::body_pose() const {
    Eigen::Isometry3d pose(left_.view.rotation * state_.motion.body->rotation);
    pose.translation() = left_.view.from_scene(state_.motion.body->translation);
    return pose;
}

void Film::place_views(const FrameState& state) {
    const CameraPose& pose = state.camera;
    left_.view.rotation = pose.rotation;
    left_.view.translation = -pose.rotation * pose.centre;
    right_.view.rotation = scene_.rig.rotation * left_.view.rotation;
    right_.view.translation = scene_.rig.rotation * left_.view.translation + scene_.rig.translation;
    if (misaligned_right_) {
        const Eigen::Matrix3d turn =
            (Eigen::AngleAxisd(state_.right.roll, Eigen::Vector3d::UnitZ()) *
             Eigen::AngleAxisd(state_.right.vergence, Eigen::Vector3d::UnitY()))
                .toRotationMatrix();
        misaligned_right_->rotation = turn * right_.view.rotation;
        misaligned_right_->translation = turn * right_.view.translation;
    }
}

void Film::misalign_right() {
    misaligned_right_.reset();
    if (state_.right.misaligned()) {
        Lens lens = scene_.rig.right;
        lens.fx *= state_.right.focal_ratio;
        lens.fy *= state_.right.focal_ratio;
        lens.cy += state_.right.offset;
        misaligned_right_.emplace(lens, width_, height_, threads_);
    }
}

/// One sheet of tissue, or two lobes and the wall between them, or the two sides of a cut, which
/// share a row of vertices where the cut is closed, and its floor, which shares their columns.
void Film::prepare_meshes() {
    meshes_.emplace_back(
        centred_lattice(kTissueHalfWidth, kTissueHalfHeight, kTissueSpacing, kTissueSpacing));
    add_texture({scene_.look, kTissueHalfWidth, kTissueHalfHeight, scene_.seed});
    painter_.add_look(textures_.front());
    if (scene_.floor) {
        DeformedMesh below = meshes_.front();
        below.first_drawn = meshes_.front().last_drawn = (below.rows - 1) / 2;
        meshes_.push_back(std::move(below));
        painter_.add_look(textures_.front());
        meshes_.emplace_back(
            centred_lattice(kTissueHalfWidth, kFloorHalfWidth, kTissueSpacing, kFloorSpacing));
        add_texture({*scene_.floor, kTissueHalfWidth, kFloorHalfWidth, ~scene_.seed});
        painter_.add_look(textures_.back());
    }
}

void Film::prepare_sheets() {
    for (const Texture& texture : scene_.textures) {
        add_texture(texture);
    }
    for (const Sheet& sheet : scene_.sheets) {
        meshes_.emplace_back(sheet.lattice);
        meshes_.back().hole = sheet.hole;
        painter_.add_look(textures_[sheet.texture]);
    }
}

void Film::add_texture(const Texture& texture) {
    textures_.emplace_back(texture.look, static_cast<float>(texture.half_width),
                           static_cast<float>(texture.half_height), texture.seed);
}

void Film::deform_meshes(const FrameState& state, const std::vector<const View*>& views) {
    const Surface& surface = scene_.surface;
    const double time = state.time;
    const Motion& motion = state.motion;
    if (!scene_.sheets.empty()) {
        for (std::size_t i = 0; i < meshes_.size(); ++i) {
            meshes_[i].deform(state.sheets[i], views, threads_);
        }
        return;
    }
    if (!scene_.floor) {
        meshes_[0].deform([&](double s, double t) { return surface.at(s, t, time, motion); }, views,
                          threads_);
        return;
    }
    const auto side = [&](Side which) {
        return [&, which](double s, double t) { return surface.at(s, t, time, motion, which); };
    };
    meshes_[0].deform(side(Side::above), views, threads_);
    meshes_[1].deform(side(Side::below), views, threads_);
    meshes_[2].deform(
        [&](double s, double t) { return surface.floor_at(s, t / kFloorHalfWidth, time, motion); },
        views, threads_);
}

/// A grid over the first left image, less the pixels where no tissue is seen and those beside a
/// cut.
void Film::choose_points() {
    const int columns = 20;
    const int rows = std::max(6, static_cast<int>(std::lround(columns * 0.95 * height_ / width_)));
    const double edge = 0.06 * width_;
    for (int j = 0; j < rows; ++j) {
        for (int i = 0; i < columns; ++i) {
            const double u =
                std::round(100 * (edge + i * (width_ - 1 - 2 * edge) / (columns - 1))) / 100;
            const double v =
                std::round(100 * (edge + j * (height_ - 1 - 2 * edge) / (rows - 1))) / 100;
            const auto pixel = static_cast<std::size_t>(std::lround(v)) * width_ +
                               static_cast<std::size_t>(std::lround(u));
            const Hit& hit = left_.hits[pixel];
            const Eigen::Vector2d ray = left_.view.lens.ray({u, v});
            const Eigen::Vector3d direction =
                state_.camera.rotation.transpose() * Eigen::Vector3d(ray.x(), ray.y(), 1);
            Followed point{u, v, {hit.s, hit.t}, hit.mesh, frame_};
            const MeshFormula at = formula_of(state_, hit.mesh);
            if (hit.z <= 0 || !intersect(at, state_.camera.centre, direction, point.material) ||
                !has_points(hit.mesh, point.material)) {
                continue;
            }
            const Eigen::Vector3d position = at(point.material.x(), point.material.y());
            if (visible(point, left_.view.from_scene(position))) {
                points_.push_back(point);
            }
        }
    }
}

void Film::add_points() {
    const std::size_t first = points_.size();
    choose_points();
    points_.erase(
        std::remove_if(points_.begin() + static_cast<std::ptrdiff_t>(first), points_.end(),
                       [&](const Followed& point) { return was_in_first_image(point); }),
        points_.end());
}

/// The formula of the tissue that a mesh shows; valid as long as the state.
MeshFormula Film::formula_of(const FrameState& state, std::uint8_t mesh) const {
    if (!scene_.sheets.empty()) {
        return state.sheets[mesh];
    }
    return [&](double s, double t) { return scene_.surface.at(s, t, state.time, state.motion); };
}

bool Film::has_points(std::uint8_t mesh, const Eigen::Vector2d& material) const {
    if (!scene_.sheets.empty()) {
        const Sheet& sheet = scene_.sheets[mesh];
        return sheet.has_points && sheet.has_points(material);
    }
    return mesh != kFloorMesh && !beside_line(state_.motion, material);
}

/// Whether tissue that may lie double shows its other side.
bool Film::is_turned_away(const FrameState& state, const Followed& point) const {
    if (scene_.sheets.empty()) {
        return false;
    }
    const MeshFormula& at = state.sheets[point.mesh];
    const Eigen::Vector3d ray = at(point.material.x(), point.material.y()) - state.camera.centre;
    return normal_of(at, point.material).dot(ray) >= 0;
}

bool Film::was_in_first_image(const Followed& point) const {
    const FrameState first = scene_.at(0);
    const Eigen::Vector3d position =
        formula_of(first, point.mesh)(point.material.x(), point.material.y());
    const Eigen::Vector3d in_left = first.camera.rotation * (position - first.camera.centre);
    if (in_left.z() <= 0 || is_turned_away(first, point)) return false;
    const Eigen::Vector2d pixel = left_.view.lens.project(in_left);
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() <= width_ - 0.5 &&
           pixel.y() <= height_ - 0.5;
}

bool Film::visible(const Followed& point, const Eigen::Vector3d& in_left) const {
    if (state_.outside != Outside::none || in_left.z() <= 0 || is_turned_away(state_, point) ||
        (state_.blood && hidden_by(*state_.blood, point.material.cast<float>()))) {
        return false;
    }
    const Eigen::Vector2d pixel = left_.view.lens.project(in_left);
    const int u = static_cast<int>(std::lround(pixel.x())),
              v = static_cast<int>(std::lround(pixel.y()));
    if (u < 0 || v < 0 || u >= width_ || v >= height_) {
        return false;
    }
    for (const Instrument& instrument : state_.instruments) {
        const Instrument tool = left_.view.from_scene(instrument);
        if (nearest_approach(tool, Eigen::Vector3d::Zero(), in_left, 0.0, 1.0).distance <
            tool.radius) {
            return false;
        }
    }
    float farthest = 0;
    for (int y = std::max(v - 1, 0); y <= std::min(v + 1, height_ - 1); ++y) {
        for (int x = std::max(u - 1, 0); x <= std::min(u + 1, width_ - 1); ++x) {
            farthest = std::max(farthest, left_.hits[static_cast<std::size_t>(y) * width_ + x].z);
        }
    }
    return in_left.z() < farthest + kOcclusionSlack;
}

/// Paints a view. The exposure has parts at several times where the shutter is open for long; those
/// of a right view that is late are at times of its own.
void Film::photograph(bool is_left) {
    const View& view = is_left ? left_.view : misaligned_right_ ? *misaligned_right_ : right_.view;
    const double middle = time_ - (is_left ? 0.0 : state_.right.lag);
    const int parts = state_.shutter > 0 ? kExposures : 1;
    for (int part = 0; part < parts; ++part) {
        const double time = middle + state_.shutter * ((part + 0.5) / parts - 0.5);
        const std::vector<Hit>* hits = is_left ? &left_.hits : &right_.hits;
        const FrameState state = time == time_ ? state_ : scene_.at(time);
        if (time != time_ || (!is_left && misaligned_right_)) {
            place_views(state);
            deform_meshes(state, {&view});
            raster_.render(meshes_, view, threads_, other_hits_);
            hits = &other_hits_;
        }
        painter_.expose(view, *hits, request_for(state, is_left), 1.0f / static_cast<float>(parts));
    }
    painter_.develop(view, sensor_of(is_left), is_left ? left_.bgr : right_.bgr);
}

PictureRequest Film::request_for(const FrameState& state, bool is_left) const {
    PictureRequest request;
    const Eigen::Vector3d lamp =
        scene_.has_coaxial_light
            ? Eigen::Vector3d(-0.5 * scene_.rig.rotation.transpose() * scene_.rig.translation)
            : Eigen::Vector3d(0.5 * scene_.rig.translation.norm(), -3.0, 0.0);
    const auto in_view = [&](const Eigen::Vector3d& point) -> Eigen::Vector3d {
        return is_left ? point
                       : Eigen::Vector3d(scene_.rig.rotation * point + scene_.rig.translation);
    };
    request.lighting.lamp = in_view(lamp);
    request.sheen = state.sheen;
    for (Eigen::Vector3d& its_lamp : request.sheen.lamps) {
        its_lamp = in_view(its_lamp);
    }
    request.lighting.distance = scene_.rig.depth;
    request.lighting.exposure = scene_.exposure * state.exposure;
    if (!is_left) {
        request.view_offset = -scene_.rig.rotation.transpose() * scene_.rig.translation;
    }
    request.instruments = state.instruments;
    request.blood = state.blood;
    request.smoke = state.smoke;
    request.focus = state.focus;
    request.outside = state.outside;
    return request;
}

Sensor Film::sensor_of(bool is_left) const {
    Sensor sensor;
    sensor.noise = scene_.noise;
    sensor.seed = scramble(scramble(scene_.seed) ^
                           (2 * static_cast<std::uint64_t>(frame_) + (is_left ? 0 : 1)));
    if (!is_left) {
        constexpr Rgb kTint{0.90f, 0.93f, 0.96f};
        sensor.gain = (state_.right.exposure / kTint.g) * kTint;
        sensor.offset = 1.5f;
        sensor.gamma = state_.right.gamma;
    }
    return sensor;
}

bool Film::hides(const Instrument& instrument, const Eigen::Vector3d& point,
                 const Eigen::Vector3d& centre) const {
    const Instrument tool = left_.view.from_scene(instrument);
    const double margin = tool.radius + point.z() / scene_.rig.left.fx;
    return nearest_approach(tool, centre, point - centre, 0, 1).distance < margin;
}

std::vector<float> Film::left_surface() const {
    std::vector<float> xyz(3 * static_cast<std::size_t>(width_) * height_,
                           std::numeric_limits<float>::quiet_NaN());
    if (state_.outside != Outside::none) {
        return xyz;
    }
    for (std::size_t pixel = 0; pixel < left_.hits.size(); ++pixel) {
        const Hit& hit = left_.hits[pixel];
        if (hit.z <= 0 || (state_.blood && hidden_by(*state_.blood, {hit.s, hit.t}))) {
            continue;
        }
        const Eigen::Vector3d point(hit.z * left_.view.rays[pixel].x(),
                                    hit.z * left_.view.rays[pixel].y(), hit.z);
        if (std::any_of(state_.instruments.begin(), state_.instruments.end(),
                        [&](const Instrument& tool) {
                            return hides(tool, point, Eigen::Vector3d::Zero());
                        })) {
            continue;
        }
        for (int i = 0; i < 3; ++i) {
            xyz[3 * pixel + static_cast<std::size_t>(i)] = static_cast<float>(point[i]);
        }
    }
    return xyz;
}

std::vector<std::uint16_t> Film::disparity() const {
    std::vector<std::uint16_t> image(static_cast<std::size_t>(width_) * height_, 0);
    const double scale = scene_.rig.left.fx * -scene_.rig.translation.x();
    if (state_.outside != Outside::none) {
        return image;
    }
    const Eigen::Vector3d right_centre(-scene_.rig.translation.x(), 0, 0);
    for (int v = 0; v < height_; ++v) {
        for (int u = 0; u < width_; ++u) {
            const std::size_t pixel = static_cast<std::size_t>(v) * width_ + u;
            const Hit& hit = left_.hits[pixel];
            if (hit.z <= 0 || (state_.blood && hidden_by(*state_.blood, {hit.s, hit.t}))) {
                continue;
            }
            const double shift = scale / hit.z;
            const double other = u - shift;
            const auto other_pixel = static_cast<std::size_t>(v) * width_ +
                                     static_cast<std::size_t>(std::max(0L, std::lround(other)));
            if (other < 0 || std::abs(right_.hits[other_pixel].z - hit.z) > 2.0 * kOcclusionSlack) {
                continue;
            }
            const Eigen::Vector3d point(hit.z * left_.view.rays[pixel].x(),
                                        hit.z * left_.view.rays[pixel].y(), hit.z);
            if (std::any_of(state_.instruments.begin(), state_.instruments.end(),
                            [&](const Instrument& tool) {
                                return hides(tool, point, Eigen::Vector3d::Zero()) ||
                                       hides(tool, point, right_centre);
                            })) {
                continue;
            }
            image[pixel] = static_cast<std::uint16_t>(std::lround(256.0 * shift));
        }
    }
    return image;
}

}  // namespace defrec::cli
