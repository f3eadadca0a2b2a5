// Rows of frames.csv and the summary, of each frame of a run. They are kept until the end, since a
// stage that runs late gets a column, and small, since a run of cameras goes on for hours.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace defrec::cli {

struct FrameNumbers {
    std::int64_t frame = 0;
    double timestamp_ms = 0;
    unsigned epoch = 0, age = 0, features = 0, matches = 0, inliers = 0, patches = 0;
    double observed_share = 0, mean_residual_mm = 0;
    double view_lag_frames = 0, vertical_offset_px = 0, roll_deg = 0, focal_ratio = 1;
    unsigned rig_matches = 0;
    double frame_ms = 0;  // all stages together
};

struct FrameRow : FrameNumbers {
    std::string state, reasons;  // reasons: names joined by |
    std::string faulty_views;    // "left", "right", "both": of which they speak; or empty
    std::vector<std::pair<std::string, double>>
        stage_ms;  // in order of execution; a name may come twice
};

class FrameLog {
  public:
    FrameLog() = default;
    FrameLog(const FrameLog&) = delete;
    FrameLog& operator=(const FrameLog&) = delete;

    void add(const FrameRow& row);

    struct Row : FrameNumbers {
        const std::string *state, *reasons, *faulty_views;  // of FrameRow
    };
    const std::vector<Row>& rows() const { return rows_; }
    // Each stage that ran, in the order of first appearance.
    struct Stage {
        std::string name;
        std::vector<float> ms;  // of each frame, all its runs together; 0 where it did not run
    };
    const std::vector<Stage>& stages() const { return stages_; }

  private:
    Stage& stage(const std::string& name);

    std::vector<Row> rows_;
    std::vector<Stage> stages_;
    std::set<std::string> texts_;  // of the rows, which have few different ones
};

}  // namespace defrec::cli
