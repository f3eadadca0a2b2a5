// overlay.mp4: the left image with the deformed grid, matches, followed points, targets and state
// drawn on it; where asked for, control points and matches that were refused as well.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "sdk/report/record.hpp"

namespace cv {
class Mat;
}

namespace defrec::cli {

enum class OverlayDetail : std::uint8_t {
    usual,
    all  ///< control points and refused matches as well, which look like faults to who does not
         ///< know them
};

/// Draws one frame. One thread at a time per object.
class OverlayPainter {
  public:
    explicit OverlayPainter(Projector projector, OverlayDetail detail = OverlayDetail::usual);
    ~OverlayPainter();
    OverlayPainter(const OverlayPainter&) = delete;
    OverlayPainter& operator=(const OverlayPainter&) = delete;

    /// Chooses the lines of the grid: every so many pixels of the template's image, followed on the
    /// surface. Without a template only matches and text are drawn. Throws std::invalid_argument if
    /// sizes or indices do not agree.
    void set_template(const TemplateRecord& reference);

    /// Draws on `image` (CV_8UC3, BGR). Geometry whose size differs from the template's is not
    /// drawn. told: what is said in place of the frame's state, a name of state_words().
    void draw(cv::Mat& image, const FrameRecord& frame, std::string_view told = {});
    /// Likewise without the text above and below and the frame round a lost one, for a page that
    /// has them beside the picture.
    void draw_without_text(cv::Mat& image, const FrameRecord& frame);

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Writes the video; encoding runs beside the caller on a thread of low priority. Everything goes
/// to a temporary name in the same folder until finish(). One thread at a time. Every failure is a
/// std::runtime_error whose text names the file and what to do (the caller's exit code 7).
class OverlayWriter {
  public:
    /// width, height: of the left images, pixels >= 16. fps: > 0, of the input; anything else
    /// becomes 25. H.264 in `path`; where this OpenCV cannot encode it, another codec, which note()
    /// then names.
    OverlayWriter(const std::filesystem::path& path, int width, int height, double fps,
                  Projector projector, OverlayDetail detail = OverlayDetail::usual);
    /// Removes the temporary file if finish() was not reached.
    ~OverlayWriter();
    OverlayWriter(const OverlayWriter&) = delete;
    OverlayWriter& operator=(const OverlayWriter&) = delete;

    void set_template(const TemplateRecord& reference);

    /// left_bgr: CV_8UC3 (or CV_8UC1) of the size given; not changed. Paints; waits if encoding is
    /// 4 frames behind. told: as OverlayPainter::draw.
    void add(const cv::Mat& left_bgr, const FrameRecord& frame, std::string_view told = {});

    /// Whether add() would wait.
    bool is_behind() const;

    /// Closes the file, checks that it reads back with as many frames as were added, and gives it
    /// its name. With no frame added no file is left. May be called once.
    void finish();

    /// The file written: the path given, or one with another extension if the codec asked for it.
    const std::filesystem::path& path() const;
    /// Empty, or an error message for the user: which codec was used in place of H.264.
    const std::string& note() const;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
