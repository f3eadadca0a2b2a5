// What writes rendered frames in the layout of a public data set. A layout is a file of its own,
// and a line in layouts.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <vector>

#include "sdk/base/os/atomic_file.hpp"
#include "sdk/scenes/film.hpp"
#include "sdk/scenes/writing/render_command.hpp"

namespace defrec::cli {

/// Takes the frames of a film one after the other.
class LayoutWriter {
  public:
    virtual ~LayoutWriter() = default;
    virtual void add(const Film& film, int frame) = 0;
    virtual void finish() = 0;
};

/// Make the folders and throw RenderUsageError where the layout cannot take the scene or the size.
std::unique_ptr<LayoutWriter> make_hamlyn_writer(const RenderOptions& options, const Scene& scene);
std::unique_ptr<LayoutWriter> make_scared_writer(const RenderOptions& options, const Scene& scene);
std::unique_ptr<LayoutWriter> make_serv_ct_writer(const RenderOptions& options, const Scene& scene);
std::unique_ptr<LayoutWriter> make_stereomis_writer(const RenderOptions& options,
                                                    const Scene& scene);
std::unique_ptr<LayoutWriter> make_stir_writer(const RenderOptions& options, const Scene& scene);
std::unique_ptr<LayoutWriter> make_stir_2026_writer(const RenderOptions& options,
                                                    const Scene& scene);
std::unique_ptr<LayoutWriter> make_super_writer(const RenderOptions& options, const Scene& scene);
std::unique_ptr<LayoutWriter> make_surgt_writer(const RenderOptions& options, const Scene& scene);

/// Throws RenderUsageError for a size that is not even, which a video cannot have.
void require_even_size(const RenderOptions& options);
/// Throws RenderUsageError for a scene with raw images.
void require_rectified(const RenderOptions& options, const Scene& scene);

void make_folder(const std::filesystem::path& path);
/// Throws RenderUsageError where the folder holds something, as an earlier sequence: it would pass
/// for frames of this one, and may be anybody's.
void make_new_folder(const std::filesystem::path& path);

/// Encoded in memory first: OpenCV's own writer does not report a full disk.
void write_image(const std::filesystem::path& path, const cv::Mat& image,
                 const std::vector<int>& parameters = {});

/// The pixels are borrowed.
cv::Mat picture_of(const std::vector<std::uint8_t>& bgr, cv::Size size);

/// Where the tissue of a point is in the right image, px. NaN outside of the image.
cv::Point2d place_in_right(const StereoRig& rig, const Eigen::Vector3d& in_left);

/// An MPEG-4 video that appears when it is complete.
class VideoFile {
  public:
    static constexpr int kFrameMs = 40;

    /// The size is even.
    VideoFile(const std::filesystem::path& path, cv::Size size);

    void add(const cv::Mat& bgr) {
        video_.write(bgr);
        ++frames_;
    }
    /// Throws RenderOutputError where the video is not whole.
    void finish();

  private:
    AtomicFile file_;
    cv::VideoWriter video_;
    std::int64_t frames_ = 0;
};

}  // namespace defrec::cli
