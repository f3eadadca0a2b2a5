// Boards with a known pattern, and where a view shows their corners.
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace defrec::cli {

enum class BoardKind { kChessboard, kCharuco };

struct BoardDescription {
    BoardKind kind = BoardKind::kChessboard;
    int across = 0, down = 0;  // squares
    double square_mm = 0, marker_mm = 0;
    std::string dictionary = "4x4_50";  // of the markers
};

// The names that BoardDescription::dictionary may have.
const std::vector<std::string>& marker_dictionaries();

// Inner corners of the board that a view shows.
struct BoardView {
    std::vector<int> ids;  // row by row, growing
    std::vector<cv::Point2f> corners;
    double sharpness = 0;  // 1/px: the steepest step beside a corner, in parts of its contrast
    bool empty() const { return ids.empty(); }
};

// One thread at a time.
class BoardFinder {
  public:
    // Throws CliError(kUsage) for a board that there cannot be.
    explicit BoardFinder(const BoardDescription& board);
    ~BoardFinder();
    BoardFinder(const BoardFinder&) = delete;
    BoardFinder& operator=(const BoardFinder&) = delete;

    const BoardDescription& board() const { return board_; }
    // Where the corner lies on the board, mm.
    cv::Point3f place(int id) const;
    // gray: a whole view. Empty where fewer corners are seen than count.
    BoardView find(const cv::Mat& gray) const;
    // What a view shows instead, for one who found nothing: a mirrored board, or one with another
    // number of squares; empty: neither.
    std::string look_closer(const cv::Mat& gray) const;

  private:
    struct Markers;
    BoardView find_chessboard(const cv::Mat& gray) const;
    BoardView find_charuco(const cv::Mat& gray) const;

    const BoardDescription board_;
    std::unique_ptr<Markers> markers_;  // of a ChArUco board
    std::vector<cv::Point3f> places_;
};

}  // namespace defrec::cli
