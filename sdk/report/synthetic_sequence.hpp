// For tests: a textured surface that heaves under a camera that drifts, with an instrument and a
// loss of tracking.
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "sdk/report/report.hpp"

namespace defrec::cli::test {

class SyntheticSequence {
  public:
    SyntheticSequence(int width, int height, int frames);

    Projector projector() const;
    TemplateRecord reference() const;
    cv::Mat image(int frame) const;

    /// Frame 0 is initialising, one fifth of the way in the surface is half covered (degraded), at
    /// three fifths it is lost for a tenth, then relocalised.
    FrameRecord record(int frame) const;

    /// The report of all frames; the template is known from the second on.
    void write_report(const std::filesystem::path& path, const ReportMeta& meta) const;

  private:
    struct Vertex {
        int column, row;
        cv::Vec3f at;  ///< mm
    };

    cv::Vec3f point(int column, int row, int frame) const;
    bool covered(const cv::Vec3f& at, int frame) const;
    FrameRecord facts(int frame) const;
    void add_vertex(const Vertex& vertex, bool hidden, FrameRecord& result) const;
    void add_estimates(const Vertex& vertex, bool hidden, FrameRecord& result) const;
    void add_match(const Vertex& vertex, FrameRecord& result) const;

    int width_, height_, frames_, columns_, rows_;
    double focal_;
    cv::Mat texture_;
};

}  // namespace defrec::cli::test
