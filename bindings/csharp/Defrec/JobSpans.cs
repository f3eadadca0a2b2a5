#if NETSTANDARD2_1
using System;
using System.Runtime.InteropServices;
using Defrec.Native;

namespace Defrec
{
    // What Job has for arrays, for spans.
    public sealed unsafe partial class Job
    {
        /// <summary>Like the overload for arrays; an empty status or expectedErrorMm is not wanted.</summary>
        /// <exception cref="ArgumentException">A span is too short, or templateXyz not a multiple of 3 long.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, failed, or its tracker has no template.</exception>
        public void WarpPoints(ReadOnlySpan<double> templateXyz, Span<double> xyz, Span<PointStatus> status, Span<double> expectedErrorMm)
        {
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(xyz.Length, templateXyz.Length, nameof(xyz));
            if (!status.IsEmpty) Check.Length(status.Length, count, nameof(status));
            if (!expectedErrorMm.IsEmpty) Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            fixed (double* from = &MemoryMarshal.GetReference(templateXyz), to = &MemoryMarshal.GetReference(xyz))
            fixed (PointStatus* belief = &MemoryMarshal.GetReference(status))
            fixed (double* error = &MemoryMarshal.GetReference(expectedErrorMm))
                Warp(from, count, to, status.IsEmpty ? null : belief, expectedErrorMm.IsEmpty ? null : error);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyMotions(Span<Motion> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (Motion* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.motions, result.node_count, sizeof(Motion), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyNodePositions(Span<float> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (float* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.node_positions, 3 * result.node_count, sizeof(float), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertices(Span<float> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (float* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.vertices, 3 * result.vertex_count, sizeof(float), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyNormals(Span<float> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (float* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.normals, 3 * result.vertex_count, sizeof(float), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertexStatus(Span<PointStatus> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (PointStatus* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.vertex_status, result.vertex_count, sizeof(PointStatus), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyExpectedErrors(Span<float> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (float* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.expected_error_mm, result.vertex_count, sizeof(float), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyLandmarks(Span<Landmark> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (Landmark* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.landmarks, result.landmark_count, sizeof(Landmark), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyLandmarkMatches(Span<Match> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (Match* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.landmark_matches, result.landmark_count, sizeof(Match), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyPatchObservations(Span<PatchObservation> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (PatchObservation* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.patch_observations, result.patch_count, sizeof(PatchObservation), to, destination.Length);
            }
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">destination is too short; the sentence says what is needed.</exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyDisparity(Span<short> destination)
        {
            using (var use = new HandleUse(Handle))
            fixed (short* to = &MemoryMarshal.GetReference(destination))
            {
                defrec_result result = Read(use);
                return Copy(result.disparity, result.disparity == null ? 0 : (ulong)pixels, sizeof(short), to, destination.Length);
            }
        }
    }
}
#endif
