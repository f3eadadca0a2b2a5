// report.html: one self-contained page about a tracked sequence. Include this header for the
// overlay as well.
//
//     OverlayWriter overlay(dir / "overlay.mp4", width, height, fps, projector);
//     ReportWriter report(dir / "report.html", meta, projector);
//     // when the template exists
//     overlay.set_template(t);
//     report.set_template(t, left_of_the_template);
//     // for each frame
//     overlay.add(left, record);
//     report.add(left, record);
//     // at the end, also after an interrupt
//     overlay.finish();
//     report.finish();
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sdk/report/overlay.hpp"
#include "sdk/report/record.hpp"

namespace defrec::cli {

enum class ReportSeverity { remark, warning, error };

/// Facts that the reader should know before the numbers.
struct ReportNote {
    ReportSeverity severity = ReportSeverity::warning;
    std::string text;
};

/// Texts for the head of the page: any UTF-8 (what is not UTF-8 is replaced), escaped by the
/// writer.
struct ReportMeta {
    std::string sequence;      ///< a name, such as the input's file name
    std::string backend;       ///< such as "cpu"
    std::string device;        ///< such as "AMD EPYC, AVX-512, 2 threads"
    std::string version;       ///< of defrec
    std::string overlay_file;  ///< name of the video beside the report, or empty
    std::vector<std::pair<std::string, std::string>>
        facts;                      ///< further lines: "Calibration", "stereo.yaml"
    std::vector<ReportNote> notes;  ///< the page shows the most severe first
};

/// Collects frames and writes the page. Memory is bounded whatever the length of the sequence: at
/// most 120 surfaces of at most about 2,000 points, 4,096 points per plotted line, 14 key frames
/// and 240 places of at most 100 followed points are kept, evenly thinned as frames arrive. One
/// thread at a time. Failures to write are std::runtime_error (the caller's exit code 7).
class ReportWriter {
  public:
    /// Fails at once if the folder of `path` cannot be written.
    ReportWriter(const std::filesystem::path& path, ReportMeta meta, Projector projector,
                 OverlayDetail detail = OverlayDetail::usual);
    ~ReportWriter();
    ReportWriter(const ReportWriter&) = delete;
    ReportWriter& operator=(const ReportWriter&) = delete;

    /// For texts that are known only later (notes, device). May be called until finish().
    ReportMeta& meta();

    /// left_bgr: the left image the template was captured from, put on the surface; may be empty.
    /// Called again for another template, the surfaces of the one before are dropped.
    /// Throws std::invalid_argument if sizes or indices do not agree.
    void set_template(const TemplateRecord& reference, const cv::Mat& left_bgr);

    /// The template with tissue that joined it, whose vertices come last, or parted by a cut.
    /// Pictures show it; the 3D view keeps to the vertices of set_template.
    void change_template(const TemplateRecord& reference);

    /// left_bgr: as OverlayWriter::add; may be empty (no key frame then). Paints and encodes only
    /// frames it may keep.
    void add(const cv::Mat& left_bgr, const FrameRecord& frame);

    /// Writes the page under a temporary name and renames it. May be called once; a page with no
    /// frame is written too.
    void finish();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace defrec::cli
