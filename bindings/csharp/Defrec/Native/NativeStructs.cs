using System;
using System.Runtime.InteropServices;

// The structs of defrec_c.h that hold pointers, under their C names, field by field; test layout holds them to the library's own list.
// The others are public, under names of C#: Records.cs, StageParameters.cs.
namespace Defrec.Native
{
    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_context_desc
    {
        internal uint struct_size;
        internal uint flags;
        internal byte** plugin_paths;
        internal UIntPtr plugin_path_count;
        internal IntPtr log;
        internal IntPtr log_user;
        internal int log_level;
        internal uint threads;
        internal IntPtr alloc;
        internal IntPtr free;
        internal IntPtr alloc_user;
        internal IntPtr parallel_for;
        internal IntPtr parallel_for_user;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_plugin_info
    {
        internal uint struct_size;
        internal Status verdict;
        internal byte* name;
        internal byte* path;
        internal byte* version;
        internal byte* reason;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_device_info
    {
        internal uint struct_size;
        internal DeviceKind kind;
        internal byte* id;
        internal byte* name;
        internal byte* driver;
        internal ulong memory_bytes;
        internal StageMask stages;
        internal DeviceFeatures features;
        internal uint conformance;
        internal uint reserved;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_image
    {
        internal uint struct_size;
        internal PixelFormat format;
        internal uint width;
        internal uint height;
        internal ulong stride;
        internal void* pixels;
        internal IntPtr memory;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_intrinsics
    {
        internal double fx;
        internal double fy;
        internal double cx;
        internal double cy;
        internal fixed double distortion[14];
        internal uint distortion_count;
        internal uint reserved;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_rig_desc
    {
        internal uint struct_size;
        internal uint flags;
        internal uint width;
        internal uint height;
        internal defrec_intrinsics left;
        internal defrec_intrinsics right;
        internal fixed double rotation[9];
        internal fixed double translation[3];
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_rig_info
    {
        internal uint struct_size;
        internal uint identity;
        internal uint width;
        internal uint height;
        internal Camera camera;
        internal fixed double rotation[9];
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_buffer
    {
        internal void* data;
        internal ulong size;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_const_buffer
    {
        internal void* data;
        internal ulong size;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_tracker_desc
    {
        internal uint struct_size;
        internal uint flags;
        internal byte* device_id;
        internal ulong seed;
        internal PixelFormat format;
        internal uint frames_in_flight;
        internal uint disparities;
        internal int min_disparity;
        internal float min_depth_mm;
        internal float node_spacing_px;
        internal float vertex_spacing_px;
        internal uint max_features;
        internal uint max_patches;
        internal float arap_weight;
        internal uint keep_disparity;
        internal uint coarse_iterations;
        internal uint fine_iterations;
        internal uint timed;
        internal uint memory_stride;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_memory_desc
    {
        internal uint struct_size;
        internal MemoryKind kind;
        internal void* address;
        internal ulong size;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_frame
    {
        internal uint struct_size;
        internal FrameFlags flags;
        internal long timestamp_ns;
        internal defrec_image* left;
        internal defrec_image* right;
        internal defrec_image* ignore;
        internal IntPtr samples;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_stage_time
    {
        internal byte* name;
        internal double milliseconds;
    }

    /// <summary>defrec_stage_time[DEFREC_MAX_TIMED_STAGES]: a fixed buffer holds nothing but numbers.</summary>
    [StructLayout(LayoutKind.Sequential)]
    internal struct defrec_stage_times
    {
        internal defrec_stage_time first;
        internal defrec_stage_time t1, t2, t3, t4, t5, t6, t7, t8, t9, t10, t11, t12, t13, t14, t15;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_result
    {
        internal uint struct_size;
        internal FrameState state;
        internal Reasons reasons;
        internal uint epoch;
        internal long timestamp_ns;
        internal ulong frame;
        internal uint age;
        internal uint features;
        internal uint matches;
        internal uint inliers;
        internal uint patches;
        internal float observed_share;
        internal float mean_residual_mm;
        internal float patch_residual_px;
        internal RigidTransform rigid_motion;
        internal Motion* motions;
        internal float* node_positions;
        internal ulong node_count;
        internal float* vertices;
        internal float* normals;
        internal byte* vertex_status;
        internal float* expected_error_mm;
        internal ulong vertex_count;
        internal Landmark* landmarks;
        internal Match* landmark_matches;
        internal ulong landmark_count;
        internal PatchObservation* patch_observations;
        internal ulong patch_count;
        internal short* disparity;
        internal defrec_stage_times times;
        internal uint time_count;
        internal uint reserved;
    }

    [StructLayout(LayoutKind.Sequential)]
    internal unsafe struct defrec_template_info
    {
        internal uint struct_size;
        internal uint width;
        internal uint height;
        internal uint reserved;
        internal Camera camera;
        internal SurfacePoint* vertices;
        internal ulong vertex_count;
        internal uint* triangles;
        internal ulong triangle_count;
        internal float* nodes;
        internal ulong node_count;
        internal Edge* edges;
        internal ulong edge_count;
        internal Landmark* landmarks;
        internal ulong landmark_count;
        internal Patch* patches;
        internal ulong patch_count;
        internal byte* image;
    }
}
