// The tracker's numbers that stand beside its options: grids where the application names none, and
// from where on a frame has a reason, as scripts/decisions/header.py reads them: unit | what it
// decides | source.
#pragma once

namespace defrec::decisions {

// The spacing of a template's grids where the application names none, and their limits.
struct Grids {
    // widths of the image | the inverse of the spacing of control points (an option) |
    //   `rendered_c`, [local-deformation]
    static constexpr float kNodesAcross = 32;
    // widths of the image | the inverse of the spacing of vertices (an option) | set by hand
    static constexpr float kVerticesAcross = 120;
    // px | the spacing of vertices is no smaller unless it is asked for | set by hand
    static constexpr float kMinVertexSpacing = 4;
    // vertices | a spacing that gives more is refused | templates of more take minutes and
    //   gigabytes
    static constexpr double kMaxVertices = 250000;
    // control points | likewise | templates of more take minutes and gigabytes
    static constexpr double kMaxNodes = 20000;
};

// From where on a frame that was found has a reason. TrackerSettings has these members as well as
// the options: one that becomes an option goes from here to the header, under the same name.
struct Reasons {
    // share of the vertices in the image | more hidden by something in front are
    //   `DEFREC_REASON_OCCLUDED` | set by hand
    double occluded_share = 0.25;
    // of the share of the vertices with depth | as large a share of the patches is confirmed: where
    //   there is no depth, the tissue is covered | at least 0.65 beneath instruments and blood; at
    //   most 0.4 in `motion-blur`, 0.15 in `fat`
    static constexpr double kCoveredConfirmed = 0.5;
    // share of the vertices in the image | more without depth are `DEFREC_REASON_NO_DEPTH` | set by
    //   hand
    double no_depth_share = 0.5;
    // mm | a larger mean depth residual is `DEFREC_REASON_LARGE_RESIDUAL` | set by hand
    double large_residual = 1;
    // share of the vertices in the image | more in checks that are refuted are
    //   `DEFREC_REASON_CONTRADICTED` | [refuted-checks]: still and beating tissue have 0 to 0.05
    double contradicted_share = 0.05;
    // share of the first view's vertices | fewer in the image are `DEFREC_REASON_OUT_OF_VIEW` | set
    //   by hand
    double out_of_view_share = 0.5;
    // mm | from frame to frame: half of the vertices that move farther are
    //   `DEFREC_REASON_FAST_MOTION` | set by hand
    float fast_motion = 5;
};

}  // namespace defrec::decisions
