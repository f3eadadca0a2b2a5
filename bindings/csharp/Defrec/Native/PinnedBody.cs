using System;

namespace Defrec.Native
{
    /// <summary>
    /// A body's description as the library reads it. Its arrays stay in their places until it is
    /// disposed.
    /// </summary>
    internal sealed unsafe class PinnedBody : IDisposable
    {
        private readonly Pins pins = new Pins();
        private readonly defrec_body_desc[] desc = new defrec_body_desc[1];

        internal PinnedBody(BodyDescription body)
        {
            try
            {
                var regions = new defrec_body_region[body.Regions.Count];
                for (int i = 0; i < regions.Length; ++i)
                {
                    string name = "body.Regions[" + i + "]";
                    BodyRegion region = body.Regions[i];
                    Check.NotNull(region, name);
                    Check.NotNull(region.Mesh, name + ".Mesh");
                    regions[i].mesh = Pin(region.Mesh, name + ".Mesh");
                    regions[i].stiffness = region.Stiffness;
                    regions[i].flags = region.IsHeld ? RegionFlags.Held : RegionFlags.None;
                }
                desc[0].struct_size = (uint)sizeof(defrec_body_desc);
                if (body.Mesh != null) desc[0].mesh = Pin(body.Mesh, "body.Mesh");
                desc[0].regions = (defrec_body_region*)pins.Add(regions);
                desc[0].region_count = (ulong)regions.Length;
                desc[0].poisson_ratio = body.PoissonRatio;
                desc[0].cut_depth_mm = body.CutDepthMm;
                Desc = (defrec_body_desc*)pins.Add(desc);
            }
            catch
            {
                Dispose();
                throw;
            }
        }

        internal defrec_body_desc* Desc { get; }

        public void Dispose() { pins.Dispose(); }

        private defrec_mesh Pin(TriangleMesh mesh, string name)
        {
            float[] vertices = mesh.Vertices;
            uint[] triangles = mesh.Triangles;
            Check.NotNull(vertices, name + ".Vertices");
            Check.NotNull(triangles, name + ".Triangles");
            return new defrec_mesh {
                vertex_count = (ulong)Check.Groups(vertices.Length, 3, name + ".Vertices"),
                triangle_count = (ulong)Check.Groups(triangles.Length, 3, name + ".Triangles"),
                vertices = (float*)pins.Add(vertices),
                triangles = (uint*)pins.Add(triangles),
            };
        }
    }
}
