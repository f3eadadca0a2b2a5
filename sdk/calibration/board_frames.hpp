// Frames of a recording in which both views show the board, and which of them are used.
#pragma once

#include <cstdint>
#include <vector>

#include "sdk/calibration/board.hpp"
#include "sdk/input/frame_source.hpp"

namespace defrec::cli {

struct BoardFrame {
    std::int64_t index = 0;  // in the recording
    BoardView left, right;   // the same corners
};

// A chessboard can be found turned by half a turn in one view alone: turns the right one's corners.
void turn_alike(const BoardView& left, BoardView& right);

struct BoardRecording {
    cv::Size size;
    FieldOrder fields = FieldOrder::kProgressive;
    std::size_t searched = 0;  // frames
    std::size_t only_left = 0, only_right = 0;
    std::vector<BoardFrame> frames;  // with the board in both views
};

// Looks for the board in frames that are evenly spread over the recording. Throws CliError(kInput)
// where frames cannot be read, or where the board is seen in no frame by both views: then with what
// is seen instead. CliError(kInterrupted) after Ctrl-C.
BoardRecording find_boards(const SourceOptions& source, const BoardFinder& finder, bool quiet);

// Which frames are used, by their place in `frames`: sharp ones, whose boards lie apart in place,
// size and tilt. The sharpest comes first.
std::vector<std::size_t> choose_frames(const BoardFinder& finder, const BoardRecording& recording);

}  // namespace defrec::cli
