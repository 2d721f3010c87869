# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of labels: rendered in the photos' colours, drawn in the label's in solid view; and of volumes."""
import bpy

from .mesh_files import linear_from_display

# Of vertices. Cycles takes an attribute called "color" for the grid of a volume.
COLOR_ATTRIBUTE = "photo_color"


def _label_color(label, result):
    color = result.colors.get(label)
    if not color:
        return (0.5, 0.5, 0.5, 1)
    return (*linear_from_display([channel / 255 for channel in color]), 1)


def _new_material(name):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    material.node_tree.nodes.clear()
    output = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    output.location = (300, 0)
    return material, material.node_tree, output


def _reusable(name, label, kind, result):
    """Returns the material that this import, or one of the same folder before, has made for a label."""
    for material in bpy.data.materials:
        if material.get("semantic_foam") == str(result.path) and material.get("label") == label and material.get(
                "kind") == kind and material.name.startswith(name):
            return material
    return None


def _attribute(tree, name, place):
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_name, node.location = name, place
    return node


def _emission_of(tree, color, output):
    """Links a surface that emits its colour, which needs no light."""
    shader = tree.nodes.new("ShaderNodeEmission")
    if color:
        tree.links.new(color, shader.inputs["Color"])
    tree.links.new(shader.outputs["Emission"], output.inputs["Surface"])
    return shader.inputs["Color"]


def _matt_of(tree, color, output):
    """Links a matt surface."""
    shader = tree.nodes.new("ShaderNodeBsdfPrincipled")
    shader.inputs["Roughness"].default_value = 1
    # Photos hold the highlights already. Blender 4 has renamed the input.
    shader.inputs["Specular" if "Specular" in shader.inputs else "Specular IOR Level"].default_value = 0
    if color:
        tree.links.new(color, shader.inputs["Base Color"])
    tree.links.new(shader.outputs["BSDF"], output.inputs["Surface"])
    return shader.inputs["Base Color"]


def _image(tree, path, place):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.extension, node.location = bpy.data.images.load(str(path), check_existing=True), "EXTEND", place
    return node


def surface_material(label, result, has_colors, shading, texture=None):
    """Returns the material of a label, named as it is. shading: PHOTO or LIT. texture: the path of its image, or None for
    the colours of the vertices.
    """
    name = result.labels.get(label, f"label_{label}" if label else "unlabelled")
    kind = f"{shading} {'texture' if texture else 'colors' if has_colors else 'plain'}"
    material = _reusable(name, label, kind, result)
    if material:
        return material
    material, tree, output = _new_material(name)
    source = None
    if texture:
        source = _image(tree, texture, (-300, 0)).outputs["Color"]
    elif has_colors:
        source = _attribute(tree, COLOR_ATTRIBUTE, (-250, 0)).outputs["Color"]
    color = _label_color(label, result)
    (_emission_of if shading == "PHOTO" else _matt_of)(tree, source, output).default_value = color
    material.diffuse_color = color
    material["semantic_foam"], material["label"], material["kind"] = str(result.path), label, kind
    return material


def volume_material(name, label, result, shading):
    """Returns a material that renders the grids `density` and `color`. shading: PHOTO, as the foam itself is rendered,
    each place emits its colour and hides what is behind it; LIT, light is scattered.

    Density in files is per unit of the files, as Cycles takes it.
    """
    kind = f"{shading} volume"
    material = _reusable(name, label, kind, result)
    if material:
        return material
    material, tree, output = _new_material(name)
    if shading == "PHOTO":
        density = _attribute(tree, "density", (-450, 100)).outputs["Fac"]
        emission = tree.nodes.new("ShaderNodeEmission")
        tree.links.new(_attribute(tree, "color", (-450, -150)).outputs["Color"], emission.inputs["Color"])
        tree.links.new(density, emission.inputs["Strength"])
        absorption = tree.nodes.new("ShaderNodeVolumeAbsorption")
        absorption.inputs["Color"].default_value = (0, 0, 0, 1)
        tree.links.new(density, absorption.inputs["Density"])
        shader = tree.nodes.new("ShaderNodeAddShader")
        for k, part in enumerate((emission, absorption)):
            part.location = (-200, -150 * k)
            tree.links.new(part.outputs[0], shader.inputs[k])
    else:
        shader = tree.nodes.new("ShaderNodeVolumePrincipled")
        shader.inputs["Color"].default_value = (1, 1, 1, 1)
        shader.inputs["Density"].default_value = 1
        shader.inputs["Density Attribute"].default_value = "density"
        shader.inputs["Color Attribute"].default_value = "color"
    tree.links.new(shader.outputs[0], output.inputs["Volume"])
    material.diffuse_color = _label_color(label, result)
    material["semantic_foam"], material["label"], material["kind"] = str(result.path), label, kind
    return material
