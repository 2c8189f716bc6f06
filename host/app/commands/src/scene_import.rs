//! Scene import: a configuration from a model file and a point list.

use std::path::{Component, Path, PathBuf};

use busbar_gltf_import::{ImportError, ImportLimits, import_file};
use busbar_point_import::{
    Catalogue, FOV_DEGREES, ListEncoding, ListFault, MAX_LIST_BYTES, NodeName, PluginInstance,
    PointList, SceneParts, TooManyNodes, assign_plugins, place, report, scene,
};
use busbar_scene::{Model, ModelIndex, NodeIndex, Placement, SceneError, SceneGraph, Transform};
use glam::Vec3;
use thiserror::Error;

/// Direction from the model's center to the eye: right, above and in front.
const TO_EYE: Vec3 = Vec3::new(0.62, 0.38, 0.69);
/// Air around the model in the picture.
const AIR: f32 = 1.1;

/// Request for a scene from a model and a point list.
#[derive(Clone, Debug)]
pub struct SceneRequest {
    /// Model, .glb or .gltf.
    pub model: PathBuf,
    /// Path of the point list, CSV.
    pub points: PathBuf,
    /// Encoding of the point list; by its mark or characters where missing.
    pub encoding: Option<ListEncoding>,
    /// Configuration that the text is for: its paths start from there.
    pub out: PathBuf,
    /// Equipment id of the model; the name of its file where missing.
    pub id: Option<String>,
    /// Plugins that bring the tags.
    pub plugins: Vec<PluginInstance>,
    /// Ids of overlay plugins.
    pub overlays: Vec<String>,
    /// Id of the plugin that simplifies the model.
    pub optimizer: Option<String>,
    /// Directories that plugins are looked for in.
    pub plugin_directories: Vec<PathBuf>,
    /// True if faulty rows are skipped.
    pub skips_bad_rows: bool,
}

/// A scene, as text, and what became of the tags.
#[derive(Clone, Debug)]
pub struct ImportedScene {
    /// Text of the configuration.
    pub text: String,
    /// Every tag in one line.
    pub report_csv: String,
    /// Report on bound tags and doubtful matches, Markdown.
    pub report_markdown: String,
    /// Number of imported tags.
    pub tags: usize,
    /// Number of tags bound to nodes.
    pub bound: usize,
    /// Rows that were left out, and why.
    pub skipped: Vec<ListFault>,
    /// Columns of the list that are not used.
    pub unused_columns: Vec<String>,
    /// Assumptions about the list: its encoding, lines that were passed over.
    pub remarks: Vec<String>,
    /// Remarks on content that the model import left out.
    pub notes: Vec<String>,
}

/// Error that prevents the scene import.
#[derive(Debug, Error)]
pub enum SceneImportError {
    /// Error of the model file.
    #[error(transparent)]
    Model(#[from] ImportError),
    /// The model's names make no scene.
    #[error("{fault}\n  remedy: {}", fault.remedy())]
    Scene {
        /// Fault of the model's names.
        fault: SceneError,
    },
    /// More nodes than tags are matched with.
    #[error(transparent)]
    Nodes(#[from] TooManyNodes),
    /// The list cannot be opened.
    #[error("cannot read '{}': {fault}\n  remedy: check the path and its rights", file.display())]
    Unreadable {
        /// Path of the point list.
        file: PathBuf,
        /// Error of the operating system.
        fault: std::io::Error,
    },
    /// No plugin is named that would bring the tags.
    #[error(
        "no plugin brings the tags\n  remedy: add --plugin NAME=PLUGIN_ID,KEY=VALUE with the id \
         and the settings of the plugin that speaks to the device; `busbar plugin list` has the ids"
    )]
    NoPlugin,
    /// Two plugins of one name.
    #[error("two plugins are called '{0}'\n  remedy: give one of them another name")]
    TwoPlugins(String),
    /// The list has faults.
    #[error("{}", list_faults_text(file, faults))]
    List {
        /// Path of the point list.
        file: PathBuf,
        /// Faults of the list.
        faults: Vec<ListFault>,
    },
}

impl From<SceneError> for SceneImportError {
    fn from(fault: SceneError) -> Self {
        Self::Scene { fault }
    }
}

fn list_faults_text(file: &Path, faults: &[ListFault]) -> String {
    let file = file.display().to_string();
    faults.iter().map(|fault| fault.render(&file)).collect::<Vec<_>>().join("\n")
}

/// Makes the scene. Nothing is written.
///
/// # Errors
/// Every fault of the list, or that of the model, or a plugin that is missing.
pub fn import_scene(request: &SceneRequest) -> Result<ImportedScene, SceneImportError> {
    check_plugins(request)?;
    let imported = import_file(&request.model, &ImportLimits::default())?;
    let id = request.id.clone().unwrap_or_else(|| stem_of(&request.model));
    let graph = place_model(&id, imported.model)?;
    let model = catalogue(&graph)?;
    let mut list = PointList::parse_in(&read(&request.points)?, request.encoding);
    let mut faults = std::mem::take(&mut list.faults);
    let mut points = list.points;
    faults.extend(assign_plugins(&mut points, &request.plugins));
    let (proposals, unknown) = place(&mut points, &model);
    faults.extend(unknown);
    faults.sort_by_key(|fault| fault.line);
    let may_go_on = request.skips_bad_rows && !list.is_unreadable && !points.is_empty();
    if !faults.is_empty() && !may_go_on {
        return Err(SceneImportError::List { file: request.points.clone(), faults });
    }
    let folder = request.out.parent().unwrap_or(Path::new(""));
    let parts = SceneParts {
        id,
        model: relative(&request.model, folder),
        plugin_directories: request
            .plugin_directories
            .iter()
            .map(|d| relative(d, folder))
            .collect(),
        plugins: request.plugins.clone(),
        overlays: request.overlays.clone(),
        optimizer: request.optimizer.clone(),
        camera: camera(&graph),
    };
    let text = format!("{:#}\n", scene(&parts, &points, &proposals));
    Ok(ImportedScene {
        text,
        report_csv: report::csv(&points, &proposals),
        report_markdown: report::markdown(&points, &proposals),
        tags: points.len(),
        bound: proposals.iter().filter(|proposal| proposal.node.is_some()).count(),
        skipped: faults,
        unused_columns: list.unused,
        remarks: list.remarks,
        notes: imported.report.notes,
    })
}

fn check_plugins(request: &SceneRequest) -> Result<(), SceneImportError> {
    if request.plugins.is_empty() {
        return Err(SceneImportError::NoPlugin);
    }
    let named = request.plugins.iter().map(|plugin| &plugin.name);
    let mut names: Vec<&String> =
        named.chain(&request.overlays).chain(&request.optimizer).collect();
    names.sort();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(SceneImportError::TwoPlugins(pair[0].clone())),
        None => Ok(()),
    }
}

/// A list of at most [`MAX_LIST_BYTES`]; of a larger one, enough to see that it is larger.
fn read(file: &Path) -> Result<Vec<u8>, SceneImportError> {
    use std::io::Read;
    let mut bytes = Vec::new();
    let opened = std::fs::metadata(file).and_then(|metadata| {
        if metadata.is_file() {
            std::fs::File::open(file)
        } else {
            Err(std::io::Error::other("it is not a regular file"))
        }
    });
    opened
        .and_then(|opened| opened.take(MAX_LIST_BYTES as u64 + 1).read_to_end(&mut bytes))
        .map_err(|fault| SceneImportError::Unreadable { file: file.to_owned(), fault })?;
    Ok(bytes)
}

/// The scene of one model, as a viewer will have it.
fn place_model(id: &str, model: Model) -> Result<SceneGraph, SceneError> {
    let placement = Placement {
        id: id.to_owned(),
        parent: None,
        transform: Transform::default(),
        model: Some(ModelIndex(0)),
        theta: None,
    };
    SceneGraph::build(&[placement], &[model])
}

fn catalogue(graph: &SceneGraph) -> Result<Catalogue, TooManyNodes> {
    let ids: Vec<String> = graph.nodes().map(|node| node.id()).collect();
    let named = ids.iter().zip(graph.nodes());
    let names: Vec<_> = named.map(|(id, node)| name_of(id, node.parent())).collect();
    Catalogue::new(&names)
}

/// Returns the name behind the last slash of an id; a root keeps its whole id.
fn name_of(id: &str, parent: Option<NodeIndex>) -> NodeName<'_> {
    let name = match parent {
        Some(_) => id.rsplit('/').next().unwrap_or(id),
        None => id,
    };
    NodeName { id, name, parent: parent.map(|parent| parent.0 as usize) }
}

fn stem_of(path: &Path) -> String {
    path.file_stem().map_or_else(|| "model".into(), |stem| stem.to_string_lossy().replace('/', "_"))
}

/// Eye and target that show the whole model.
fn camera(graph: &SceneGraph) -> Option<[[f32; 3]; 2]> {
    let bounds = graph.bounds()?;
    let middle = 0.5 * (bounds.min + bounds.max);
    let radius = (0.5 * (bounds.max - bounds.min).length()).max(1e-3);
    let distance = AIR * radius / (0.5 * FOV_DEGREES.to_radians()).sin();
    let eye = middle + TO_EYE.normalize() * distance;
    eye.is_finite().then(|| [eye.to_array(), middle.to_array()])
}

/// The path from a folder, by `..` where it must be; absolute where they share nothing.
fn relative(path: &Path, folder: &Path) -> String {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (Ok(path_there), Ok(folder)) = (path.canonicalize(), folder.canonicalize()) else {
        return path.display().to_string();
    };
    let (there, here): (Vec<_>, Vec<_>) =
        (path_there.components().collect(), folder.components().collect());
    let shared = there.iter().zip(&here).take_while(|(a, b)| a == b).count();
    if shared <= 1 {
        return path_there.display().to_string();
    }
    let up = std::iter::repeat_n(Component::ParentDir, here.len() - shared);
    let steps = up.chain(there[shared..].iter().copied());
    let relative: PathBuf = steps.collect();
    if relative.as_os_str().is_empty() { ".".into() } else { relative.display().to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_start_from_the_scene() {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let model = here.join("src/lib.rs");
        assert_eq!(relative(&model, here), "src/lib.rs");
        assert_eq!(relative(&model, &here.join("src")), "lib.rs");
        assert_eq!(relative(here, here), ".");
        assert_eq!(relative(&here.join("../ui"), &here.join("src")), "../../ui");
    }
}
