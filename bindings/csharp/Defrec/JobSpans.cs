#if NETSTANDARD2_1
using System;
using System.Runtime.InteropServices;
using Defrec.Native;

namespace Defrec
{
    // What Job has for arrays, for spans.
    public sealed unsafe partial class Job
    {
        /// <summary>
        /// Like the overload for arrays; an empty status or expectedErrorMm is not wanted.
        /// </summary>
        /// <exception cref="ArgumentException">
        /// A span is too short, or templateXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template.
        /// </exception>
        public void WarpPoints(
            ReadOnlySpan<double> templateXyz, Span<double> xyz, Span<PointStatus> status,
            Span<double> expectedErrorMm)
        {
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(xyz.Length, templateXyz.Length, nameof(xyz));
            if (!status.IsEmpty) Check.Length(status.Length, count, nameof(status));
            if (!expectedErrorMm.IsEmpty)
                Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            fixed (
                double* from = &MemoryMarshal.GetReference(templateXyz),
                to = &MemoryMarshal.GetReference(xyz))
            fixed (PointStatus* statuses = &MemoryMarshal.GetReference(status))
            fixed (double* error = &MemoryMarshal.GetReference(expectedErrorMm))
                Warp(
                    from, count, to, status.IsEmpty ? null : statuses,
                    expectedErrorMm.IsEmpty ? null : error);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// A span is too short, or templateXyz not a multiple of 3 long.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">
        /// The job is not done, failed, or its tracker has no template.
        /// </exception>
        public void GetPointCovariances(
            ReadOnlySpan<double> templateXyz, Span<double> covariance, Span<Evidence> evidence)
        {
            int count = Check.Groups(templateXyz.Length, 3, nameof(templateXyz));
            Check.Length(covariance.Length, 6L * count, nameof(covariance));
            if (!evidence.IsEmpty) Check.Length(evidence.Length, count, nameof(evidence));
            fixed (
                double* from = &MemoryMarshal.GetReference(templateXyz),
                to = &MemoryMarshal.GetReference(covariance))
            fixed (Evidence* observed = &MemoryMarshal.GetReference(evidence))
                GetCovariances(from, count, to, evidence.IsEmpty ? null : observed);
        }

        /// <summary>
        /// Like the overload for arrays; an empty status, expectedErrorMm or covariance is not
        /// wanted.
        /// </summary>
        /// <exception cref="ArgumentException">targets is null, or a span is too short.</exception>
        /// <exception cref="ObjectDisposedException">
        /// The job was disposed, or the targets were.
        /// </exception>
        /// <exception cref="DefrecException">As of the overload for arrays.</exception>
        public void MoveTargets(
            Targets targets, Span<double> xyz, Span<PointStatus> status,
            Span<double> expectedErrorMm, Span<double> covariance)
        {
            Check.NotNull(targets, nameof(targets));
            int count = targets.Count;
            Check.Length(xyz.Length, 3L * count, nameof(xyz));
            if (!status.IsEmpty) Check.Length(status.Length, count, nameof(status));
            if (!expectedErrorMm.IsEmpty)
                Check.Length(expectedErrorMm.Length, count, nameof(expectedErrorMm));
            if (!covariance.IsEmpty)
                Check.Length(covariance.Length, 6L * count, nameof(covariance));
            fixed (double* to = &MemoryMarshal.GetReference(xyz))
            fixed (PointStatus* statuses = &MemoryMarshal.GetReference(status))
            fixed (double* error = &MemoryMarshal.GetReference(expectedErrorMm),
                   errors = &MemoryMarshal.GetReference(covariance))
                Move(
                    targets, to, status.IsEmpty ? null : statuses,
                    expectedErrorMm.IsEmpty ? null : error, covariance.IsEmpty ? null : errors);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyMotions(Span<Motion> destination)
        {
            fixed (Motion* to = &MemoryMarshal.GetReference(destination))
                return CopyMotions(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyNodePositions(Span<float> destination)
        {
            fixed (float* to = &MemoryMarshal.GetReference(destination))
                return CopyNodePositions(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertices(Span<float> destination)
        {
            fixed (float* to = &MemoryMarshal.GetReference(destination))
                return CopyVertices(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyNormals(Span<float> destination)
        {
            fixed (float* to = &MemoryMarshal.GetReference(destination))
                return CopyNormals(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertexStatus(Span<PointStatus> destination)
        {
            fixed (PointStatus* to = &MemoryMarshal.GetReference(destination))
                return CopyVertexStatus(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyExpectedErrors(Span<float> destination)
        {
            fixed (float* to = &MemoryMarshal.GetReference(destination))
                return CopyExpectedErrors(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertexCovariance(Span<float> destination)
        {
            fixed (float* to = &MemoryMarshal.GetReference(destination))
                return CopyVertexCovariance(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyVertexEvidence(Span<Evidence> destination)
        {
            fixed (Evidence* to = &MemoryMarshal.GetReference(destination))
                return CopyVertexEvidence(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyLandmarks(Span<Landmark> destination)
        {
            fixed (Landmark* to = &MemoryMarshal.GetReference(destination))
                return CopyLandmarks(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyLandmarkMatches(Span<Match> destination)
        {
            fixed (Match* to = &MemoryMarshal.GetReference(destination))
                return CopyLandmarkMatches(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyPatchObservations(Span<PatchObservation> destination)
        {
            fixed (PatchObservation* to = &MemoryMarshal.GetReference(destination))
                return CopyPatchObservations(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyPieces(Span<Piece> destination)
        {
            fixed (Piece* to = &MemoryMarshal.GetReference(destination))
                return CopyPieces(to, destination.Length);
        }

        /// <summary>Like the overload for arrays.</summary>
        /// <exception cref="ArgumentException">
        /// destination is too short; the error message says what is needed.
        /// </exception>
        /// <exception cref="ObjectDisposedException">The job was disposed.</exception>
        /// <exception cref="DefrecException">The job is not done, or failed.</exception>
        public int CopyDisparity(Span<short> destination)
        {
            fixed (short* to = &MemoryMarshal.GetReference(destination))
                return CopyDisparity(to, destination.Length);
        }
    }
}
#endif
