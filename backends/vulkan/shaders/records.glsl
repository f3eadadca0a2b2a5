// The records of defrec_c.h. All members are scalars of 4 bytes, so that std430 lays them out as C
// does.
struct Feature {  // defrec_feature
    int x, y;
    uint level_angle;  // level in the low, angle in the high 16 bits
    uint score;
    uint descriptor[8];
};

struct Landmark {  // defrec_landmark
    uint descriptor[8];
    float position[3];
    uint reserved;
};

struct Match {  // defrec_match
    int feature;
    int distance, second;
    float u, v;
    float position[3];
    float weight;
    uint reserved;
};

struct SurfacePoint {  // defrec_surface_point
    float position[3];
    float normal[3];
    int node[4];
    float weight[4];
};

struct Patch {  // defrec_patch
    float u, v;
    int view;
    uint reserved;
    float position[3];
    float tangent_u[3];
    float tangent_v[3];
    int node[4];
    float weight[4];
    uint reserved2;
};

struct PatchSlope {  // defrec_patch_slope
    float weight_u[4];
    float weight_v[4];
};

struct PatchPrediction {  // defrec_patch_prediction
    int u, v;
    int view_from_live[4];
    int valid;
    int reserved;
};

struct PatchObservation {  // defrec_patch_observation
    int u, v;
    int score;
    int valid;
    float information[3];
    uint reserved;
};

struct Motion {  // defrec_motion
    float real[4];
    float dual[4];
};

struct Edge {  // defrec_edge
    int a, b;
    float weight;
};

struct SurfaceSample {  // defrec_surface_sample
    float position[3];
    float normal[3];
    float residual;
    uint observation;
};

struct RansacSummary {  // defrec_ransac_summary
    int valid_matches, references, inliers, best_support;
    float rotation[9];
    float translation[3];
};

struct LmSummary {  // defrec_lm_summary
    float initial_cost, final_cost;
    float icp_cost, match_cost, patch_cost, arap_cost;
    int iterations;
    int icp_points, matches, patches;
    float icp_rms, match_rms, patch_rms;
    float damping;
    int failed;
    uint reserved;
};
