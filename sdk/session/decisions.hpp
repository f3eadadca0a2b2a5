// The numbers by which a run of `defrec track` decides, as scripts/decisions/header.py reads them:
// unit | what it decides | source. [name] is a page of docs/experiments.
#pragma once

#include <cstddef>
#include <cstdint>

namespace defrec::decisions {

// Which frame of a recording gives the template.
struct TemplateSearch {
    // frames | that are looked at after the template's for one that shows far more of the tissue
    //   | a second and more
    static constexpr std::int64_t kLookAhead = 40;
    // of the features of the template's frame | a frame with as many shows far more of the tissue |
    //   as `richer` of a template on trial
    static constexpr std::uint32_t kRicher = 2;
    // 1 | all features that are looked for, over those of such a frame, at most | faint texture has
    //   16 to 207 of 768, most of them less than 100, which are noise, [faint-texture]
    static constexpr std::uint32_t kRichest = 4;
    // frames | before the template's that are followed in reverse; they are in memory at once | set
    //   by hand
    static constexpr std::int64_t kLongestWayBack = 32;
};

// The points that a run follows.
struct FollowedPoints {
    // mm | points that are lifted in a frame before the template's with a larger error are lost |
    //   sigma 2 and 3, [sound-start]
    static constexpr double kMaxLiftError = 0.3;
    // points | of the grid in a row, where none are given | set by hand
    static constexpr int kGridColumns = 16;
    // points | of the grid in a column | set by hand
    static constexpr int kGridRows = 9;
    // share of the image | between the grid and each edge | set by hand
    static constexpr double kGridMargin = 0.05;
    // mm | a point nearer to the camera has no pixel | set by hand
    static constexpr double kNearest = 1e-3;
};

// Targets that lie where no tissue of the template can be.
struct TargetPlaces {
    // mm | nearer to the camera than all of the surface: in front of the tissue | set by hand: what
    //   registrations are off by, and more
    static constexpr double kInFront = 20;
    // mm | farther from the surface: of no tissue that is followed | set by hand: a liver is not as
    //   deep
    static constexpr double kFarAway = 150;
    // mm | all targets that lie as near to each other are in metres | an organ's longest side in
    //   metres
    static constexpr double kOnePoint = 0.3;
    // vertices | of the surface, at most, that each target is compared with | set by hand
    static constexpr std::size_t kVertices = 1000;
};

// A view that is late so often that rows tell nothing of the calibration.
struct LastingViewLag {
    // share of the frames in which rows speak against the calibration | in which a view is late, at
    //   least | set by hand: a lag is measured some frames after it shows in rows
    static constexpr double kShareOfDrifted = 0.3;
};

// Expected errors that are large after the start, said in notes.
struct StartErrors {
    // frames | in which the surface is found, from the first on, that are looked at | set by hand
    static constexpr std::size_t kFrames = 60;
    // mm | smaller medians over observed vertices are not large | set by hand
    static constexpr double kMinLarge = 1;
    // of the smallest median of these frames | and smaller ones neither: tissue may be far | set by
    //   hand; 10 and more in reference sequences
    static constexpr double kLarge = 5;
};

}  // namespace defrec::decisions
