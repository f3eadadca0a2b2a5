// A scene, filmed frame by frame in memory: the pictures of both views and the exact truth. Writes
// nothing.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "sdk/scenes/mesh_raster.hpp"
#include "sdk/scenes/picture.hpp"
#include "sdk/scenes/scene.hpp"
#include "sdk/scenes/tissue.hpp"

namespace defrec::cli {

class Film {
  public:
    struct Followed {
        double u, v;               ///< px, left image as given
        Eigen::Vector2d material;  ///< what is there
        std::uint8_t mesh = 0;     ///< and on which of the meshes
        int frame = 0;             ///< whose image
    };
    struct Truth {
        Eigen::Vector3d position;  ///< left camera as given, not rectified, mm
        bool visible;
    };

    /// A place of a body's material, beneath the surface or on it.
    struct Target {
        Eigen::Vector2d material;
        std::size_t layer;  ///< of kBodyDepths
    };

    /// As RenderOptions has it; frames at least 1. Throws what make_scene() throws.
    Film(const std::string& scene, int width, int height, int frames, std::uint64_t seed,
         int threads, const std::vector<SceneSetting>& settings = {});

    const Scene& scene() const { return scene_; }
    /// To the next frame, `step` frames of the scene later; the first call gives frame 0, at time
    /// 0. At most until the scene's frames are over.
    void advance(double step = 1);

    // Images of the present frame.
    const std::vector<std::uint8_t>& left_bgr() const { return left_.bgr; }
    const std::vector<std::uint8_t>& right_bgr() const { return right_.bgr; }
    bool shows_tissue() const { return state_.outside == Outside::none; }
    Truth truth(std::size_t point) const;
    /// 256 x px of the left picture's tissue, 0 unknown; rectified scenes only.
    std::vector<std::uint16_t> disparity() const;
    /// x y z of the tissue in each pixel of the left picture, left camera as given, mm; NaN where
    /// none is seen.
    std::vector<float> left_surface() const;

    /// A grid over the first left image, less the pixels where no tissue is seen, and those of
    /// add_points().
    const std::vector<Followed>& points() const { return points_; }
    /// Appends a grid over the present left image, less the pixels where no tissue is seen or
    /// tissue that lay within the first image and did not show its other side there.
    void add_points();

    /// A grid in each layer of the scene's body; empty in a scene without one.
    const std::vector<Target>& targets() const { return targets_; }
    /// Left camera as given, mm.
    Eigen::Vector3d truth(const Target& target) const;
    /// From the scene's body at rest to the left camera as given, but for elastic displacement.
    Eigen::Isometry3d body_pose() const;

  private:
    struct FilmedView {
        View view;                        ///< as calibration.yaml has it
        std::vector<Hit> hits{};          ///< at the frame's time
        std::vector<std::uint8_t> bgr{};  ///< the picture
    };

    void place_views(const FrameState& state);
    void misalign_right();
    void prepare_meshes();
    void prepare_sheets();
    void add_texture(const Texture& texture);
    void deform_meshes(const FrameState& state, const std::vector<const View*>& views);
    void choose_points();
    void photograph(bool is_left);
    PictureRequest request_for(const FrameState& state, bool is_left) const;
    Sensor sensor_of(bool is_left) const;
    bool hides(const Instrument& instrument, const Eigen::Vector3d& point,
               const Eigen::Vector3d& centre) const;
    MeshFormula formula_of(const FrameState& state, std::uint8_t mesh) const;
    bool has_points(std::uint8_t mesh, const Eigen::Vector2d& material) const;
    bool is_turned_away(const FrameState& state, const Followed& point) const;
    bool visible(const Followed& point, const Eigen::Vector3d& in_left) const;
    bool was_in_first_image(const Followed& point) const;

    int width_, height_, threads_;
    int frame_ = -1;
    double time_ = 0;  ///< of the frame, in the scene's frames
    Scene scene_;
    std::deque<Tissue> textures_;
    std::vector<DeformedMesh> meshes_;
    FilmedView left_, right_;
    std::optional<View> misaligned_right_;  ///< the right view as it is, where it is not right_
    Painter painter_;
    MeshRaster raster_;
    FrameState state_;
    std::vector<Hit> other_hits_;  ///< of another time or of misaligned_right_
    std::vector<Followed> points_;
    std::vector<Target> targets_;
};

}  // namespace defrec::cli
