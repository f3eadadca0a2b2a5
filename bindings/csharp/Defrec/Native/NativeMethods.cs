using System;
using System.Runtime.InteropServices;

namespace Defrec.Native
{
    /// <summary>The functions of defrec_c.h, as they are: pointers and numbers, nothing that the runtime would convert or copy.</summary>
    internal static unsafe class NativeMethods
    {
        /// <summary>With the major version in it: a library with another major version is another file.</summary>
        internal const string Library = "libdefrec.so.1";

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern uint defrec_version();

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern byte* defrec_version_string();

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern byte* defrec_status_name(Status status);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern byte* defrec_last_error();

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_context_create(defrec_context_desc* desc, IntPtr* context);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern void defrec_context_destroy(IntPtr context);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern UIntPtr defrec_plugin_count(IntPtr context);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_plugin_get(IntPtr context, UIntPtr index, defrec_plugin_info* info);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern UIntPtr defrec_device_count(IntPtr context);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_device_get(IntPtr context, UIntPtr index, defrec_device_info* info);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_rig_create(IntPtr context, defrec_rig_desc* desc, IntPtr* rig);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern void defrec_rig_destroy(IntPtr rig);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_rig_get(IntPtr rig, defrec_rig_info* info);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_rig_rectify_pixels(IntPtr rig, double* rawUv, UIntPtr count, double* rectifiedUv);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_rig_distort_pixels(IntPtr rig, double* rectifiedUv, UIntPtr count, double* rawUv);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_stage_create(IntPtr context, byte* deviceId, StageKind stage, void* parameters, IntPtr* created);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern void defrec_stage_destroy(IntPtr stage);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_stage_prepare(IntPtr stage, defrec_const_buffer* inputs, UIntPtr inputCount);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_stage_run(IntPtr stage, defrec_const_buffer* inputs, UIntPtr inputCount,
                                                       defrec_buffer* outputs, UIntPtr outputCount);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_tracker_create(IntPtr context, IntPtr rig, defrec_tracker_desc* desc, IntPtr* tracker);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern void defrec_tracker_destroy(IntPtr tracker);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_memory_import(IntPtr tracker, defrec_memory_desc* desc, IntPtr* memory);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern void defrec_memory_release(IntPtr memory);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_tracker_submit(IntPtr tracker, defrec_frame* frame, IntPtr* job);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_job_wait(IntPtr job, ulong timeoutNs);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern void defrec_job_release(IntPtr job);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_job_result(IntPtr job, defrec_result* result);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_job_warp_points(IntPtr job, double* templateXyz, UIntPtr count, double* xyz, byte* status,
                                                             double* expectedErrorMm);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_tracker_get_template(IntPtr tracker, IntPtr* template);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_tracker_set_template(IntPtr tracker, IntPtr template);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern void defrec_template_release(IntPtr template);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_template_get(IntPtr template, defrec_template_info* info);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_template_lift(IntPtr template, double* uv, UIntPtr count, double* xyz, byte* found);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_template_save(IntPtr template, byte* path);

        [DllImport(Library, CallingConvention = CallingConvention.Cdecl, ExactSpelling = true)]
        internal static extern Status defrec_template_load(IntPtr context, byte* path, IntPtr* template);
    }
}
