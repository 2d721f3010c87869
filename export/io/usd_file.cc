// SPDX-License-Identifier: GPL-3.0-or-later
#include "export/io/usd_file.h"

#include "export/scene/names.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace semfoam {
namespace {

// Returns a string of USD's text format, with its quotes.
std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : OneLine(text)) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

template <typename Vector>
void WriteTuple(const Vector& vector, ByteWriter* out) {
  const char* separator = "(";
  for (const auto value : vector) {
    out->Text(separator);
    out->Number(value);
    separator = ", ";
  }
  out->Text(")");
}

// [item, item, ...], where write(k) writes item k.
template <typename Write>
void WriteArray(size_t count, const Write& write, ByteWriter* out) {
  out->Text("[");
  for (size_t k = 0; k < count; ++k) {
    if (k > 0) out->Text(", ");
    write(k);
  }
  out->Text("]");
}

// USD's attributes of a field besides its name; empty: not written.
struct FieldTraits {
  const char* field_class;
  const char* data_type;
  const char* vector_role;
};

FieldTraits TraitsOf(const std::string& quantity) {
  if (quantity == "density") return {"fogVolume", "float", ""};
  if (quantity == "surface") return {"levelSet", "float", ""};
  if (quantity == "color") return {"", "float3", "Color"};
  return {"", "float", ""};
}

void WriteVolume(const std::string& prim,
                 const std::string& volume_path,
                 const std::vector<VolumeField>& fields,
                 ByteWriter* out) {
  out->Text("\n        def Volume \"volume\"\n        {\n");
  for (const VolumeField& field : fields) {
    out->Text("            rel field:" + field.quantity + " = </scene/" + prim + "/volume/" +
              field.quantity + ">\n");
  }
  out->Text("            token visibility = \"invisible\"\n");
  for (const VolumeField& field : fields) {
    const auto write_token = [&](const std::string& name, const std::string& value) {
      if (value.empty()) return;
      out->Text("                token " + name + " = \"");
      out->Text(value + "\"\n");
    };
    const FieldTraits traits = TraitsOf(field.quantity);
    out->Text("\n            def OpenVDBAsset \"" + field.quantity + "\"\n            {\n");
    write_token("fieldClass", traits.field_class);
    write_token("fieldDataType", traits.data_type);
    write_token("fieldName", field.grid_name);
    out->Text("                asset filePath = @./" + volume_path + "@\n");
    write_token("vectorDataRoleHint", traits.vector_role);
    out->Text("            }\n");
  }
  out->Text("        }\n");
}

void WriteTextureCoordinates(const SurfaceTexture& texture, ByteWriter* out) {
  out->Text("            texCoord2f[] primvars:st = ");
  WriteArray(
      texture.coordinates.size(),
      [&](size_t i) {
        // From the lower left corner.
        const Eigen::Vector2f& coordinates = texture.coordinates[i];
        WriteTuple(std::array<float, 2>{coordinates.x(), 1 - coordinates.y()}, out);
      },
      out);
  out->Text(" (\n                interpolation = \"faceVarying\"\n            )\n");
  out->Text("            int[] primvars:st:indices = ");
  WriteArray(
      3 * texture.triangles.size(),
      [&](size_t k) { out->Number(texture.triangles[k / 3][k % 3]); },
      out);
  out->Text("\n");
}

void WriteMaterial(const std::string& prim, const std::string& image_path, ByteWriter* out) {
  const std::string path = "/scene/" + prim + "/material";
  out->Text("\n        def Material \"material\"\n        {\n");
  out->Text("            token outputs:surface.connect = <" + path + "/shader.outputs:surface>\n");
  out->Text("\n            def Shader \"shader\"\n            {\n");
  out->Text("                uniform token info:id = \"UsdPreviewSurface\"\n");
  out->Text("                color3f inputs:diffuseColor.connect = <" + path +
            "/texture.outputs:rgb>\n");
  out->Text("                float inputs:roughness = 1\n");
  out->Text("                token outputs:surface\n            }\n");
  out->Text("\n            def Shader \"texture\"\n            {\n");
  out->Text("                uniform token info:id = \"UsdUVTexture\"\n");
  out->Text("                asset inputs:file = @./" + image_path + "@\n");
  out->Text("                token inputs:sourceColorSpace = \"sRGB\"\n");
  out->Text("                float2 inputs:st.connect = <" + path +
            "/coordinates.outputs:result>\n");
  out->Text("                token inputs:wrapS = \"clamp\"\n");
  out->Text("                token inputs:wrapT = \"clamp\"\n");
  out->Text("                float3 outputs:rgb\n            }\n");
  out->Text("\n            def Shader \"coordinates\"\n            {\n");
  out->Text("                uniform token info:id = \"UsdPrimvarReader_float2\"\n");
  out->Text("                string inputs:varname = \"st\"\n");
  out->Text("                float2 outputs:result\n            }\n        }\n");
}

}  // namespace

UsdFile::UsdFile(const std::filesystem::path& path,
                 const ExportTransform& transform,
                 const std::string& creator)
    : out_(path) {
  out_.Text("#usda 1.0\n(\n    customLayerData = {\n        string creator = ");
  out_.Text(Quoted(creator) + "\n        string frame = ");
  out_.Text(Quoted(ExportTransformJson(transform)) + "\n    }\n");
  out_.Text("    defaultPrim = \"scene\"\n    metersPerUnit = ");
  out_.Number(transform.MetersPerUnit());
  out_.Text(transform.up_axis == UpAxis::kY ? "\n    upAxis = \"Y\"\n)\n"
                                            : "\n    upAxis = \"Z\"\n)\n");
  out_.Text("\ndef Xform \"scene\" (\n    kind = \"assembly\"\n)\n{\n");
}

void UsdFile::Add(const ObjectInfo& object,
                  const UsdSurface& usd_surface,
                  const std::string& volume_path,
                  const std::vector<VolumeField>& volume_fields) {
  const ObjectSurface& surface = usd_surface.surface;
  const LocalMesh& mesh = usd_surface.mesh;
  const SurfaceTexture* const texture = usd_surface.texture;
  const std::string prim = PrimName(object);
  const size_t num_vertices = surface.vertices.size();
  const size_t num_triangles = surface.triangles.size();
  ByteWriter& out = out_;
  out.Text("    def Xform \"" + prim + "\" (\n");
  out.Text("        apiSchemas = [\"SemanticsLabelsAPI:class\"]\n        customData = {\n");
  out.Text("            double confidence = ");
  out.Number(object.confidence);
  out.Text("\n            int id = " + std::to_string(Value(object.id)) +
           "\n            string name = ");
  out.Text(Quoted(object.name) + "\n        }\n        displayName = " + Quoted(object.name));
  out.Text(
      "\n        kind = \"component\"\n    )\n    {\n        token[] semantics:labels:class = [");
  out.Text(Quoted(object.name) + "]\n\n        def Mesh \"surface\"");
  if (texture != nullptr) {
    out.Text(" (\n            apiSchemas = [\"MaterialBindingAPI\"]\n        )");
  }
  out.Text("\n        {\n            float3[] extent = [");
  WriteTuple(mesh.box.min(), &out);
  out.Text(", ");
  WriteTuple(mesh.box.max(), &out);
  out.Text("]\n            int[] faceVertexCounts = ");
  WriteArray(
      num_triangles, [&](size_t) { out.Text("3"); }, &out);
  out.Text("\n            int[] faceVertexIndices = ");
  WriteArray(
      3 * num_triangles, [&](size_t k) { out.Number(surface.triangles[k / 3][k % 3]); }, &out);
  if (texture != nullptr) {
    out.Text("\n            rel material:binding = </scene/" + prim + "/material>");
  }
  out.Text("\n            normal3f[] normals = ");
  WriteArray(
      num_vertices, [&](size_t v) { WriteTuple(mesh.normals[v], &out); }, &out);
  out.Text(" (\n                interpolation = \"vertex\"\n            )\n");
  out.Text("            uniform token orientation = \"rightHanded\"\n");
  out.Text("            point3f[] points = ");
  WriteArray(
      num_vertices, [&](size_t v) { WriteTuple(mesh.positions[v], &out); }, &out);
  out.Text("\n            float[] primvars:confidence = ");
  WriteArray(
      num_vertices, [&](size_t v) { out.Number(surface.vertex_confidence[v]); }, &out);
  out.Text(" (\n                interpolation = \"vertex\"\n            )\n");
  out.Text("            color3f[] primvars:displayColor = ");
  WriteArray(
      num_vertices,
      [&](size_t v) {
        std::array<float, 3> light;
        for (int c = 0; c < 3; ++c) light[c] = LinearLight(surface.vertex_color[v][c]);
        WriteTuple(light, &out);
      },
      &out);
  out.Text(" (\n                interpolation = \"vertex\"\n            )\n");
  out.Text("            int primvars:label = " + std::to_string(Value(object.id)));
  out.Text(" (\n                interpolation = \"constant\"\n            )\n");
  if (texture != nullptr) WriteTextureCoordinates(*texture, &out);
  out.Text("            uniform token subdivisionScheme = \"none\"\n");
  out.Text("            double3 xformOp:translate = ");
  WriteTuple(mesh.origin, &out);
  out.Text("\n            uniform token[] xformOpOrder = [\"xformOp:translate\"]\n        }\n");
  if (texture != nullptr) WriteMaterial(prim, usd_surface.image_path, &out);
  if (!volume_fields.empty()) WriteVolume(prim, volume_path, volume_fields, &out);
  out.Text("    }\n");
}

void UsdFile::Finish() {
  out_.Text("}\n");
  out_.Finish();
}

std::string UsdFile::PrimName(const ObjectInfo& object) {
  std::string name = SanitizedName(object.id, object.name);
  std::replace(name.begin(), name.end(), '-', '_');
  if (name[0] >= '0' && name[0] <= '9') name.insert(name.begin(), '_');
  while (!prim_names_.insert(name).second)
    name.append("_").append(std::to_string(Value(object.id)));
  return name;
}

}  // namespace semfoam
