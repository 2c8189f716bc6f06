//! Rewriting of a text with former names: present names in the same order and layout.

use std::cmp::Reverse;

use jsonc_parser::ParseOptions;
use jsonc_parser::cst::{
    CstInputValue, CstNode, CstObject, CstObjectProp, CstRootNode, ObjectPropName,
};
use serde_json::Value;

use crate::former_names::{FormerPlaces, converted};
use crate::schema::CompiledSchema;
use crate::{Diagnostic, RenamedSetting, RenamedSettings, pointer, scenario, schema, syntax};

/// Kinds of a text that settings have names in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TextKind {
    /// Text of a configuration, with a scene.
    Configuration,
    /// Text of a scenario for simulated devices, with events.
    Scenario,
}

/// A text with present names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UpgradedText {
    /// The text; the former one where nothing was renamed.
    pub text: String,
    /// Kind of the text.
    pub kind: TextKind,
    /// Settings that were renamed.
    pub renamed: Vec<RenamedSetting>,
}

/// Rewrites former names in the text of a configuration or scenario.
///
/// `more` gives renamed settings that the schema does not know, such as those of plugins, from
/// the document with present names.
///
/// # Errors
/// Faults of a text that is no JSON, settings given under both names, and a text that cannot be
/// rewritten: nothing is told to be renamed that is not.
pub fn upgrade(
    text: &str,
    more: impl FnOnce(&mut Value) -> RenamedSettings,
) -> Result<UpgradedText, Vec<Diagnostic>> {
    let mut document = syntax::read(text)?;
    let kind = kind_of(&document.value);
    let schema: &CompiledSchema = match kind {
        TextKind::Configuration => &schema::CONFIGURATION,
        TextKind::Scenario => &scenario::FORM,
    };
    let mut names = schema.former_names.rename(&mut document.value);
    document.positions.add_former(names.renamed.iter().cloned());
    names.extend(more(&mut document.value));
    if !names.conflicts.is_empty() {
        return Err(names.conflict_errors(&document.positions));
    }
    let Some(text) = rewritten(text, &names.renamed) else {
        let cause = "its settings cannot be renamed in place";
        let remedy = "write the present names by hand: `busbar check` tells them";
        return Err(vec![document.positions.diagnostic("", cause, remedy)]);
    };
    Ok(UpgradedText { text, kind, renamed: names.renamed })
}

/// Returns the kind of a document: a scenario has events, a configuration a scene.
fn kind_of(document: &Value) -> TextKind {
    if document.get("events").is_some() && document.get("scene").is_none() {
        TextKind::Scenario
    } else {
        TextKind::Configuration
    }
}

/// Returns the text with all settings renamed; none where one of them cannot be.
fn rewritten(text: &str, renamed: &[RenamedSetting]) -> Option<String> {
    let root = CstRootNode::parse(text, &ParseOptions::default()).ok()?;
    let places: FormerPlaces = renamed.iter().cloned().collect();
    // What is inside goes first, while its place is still as written.
    let mut order: Vec<&RenamedSetting> = renamed.iter().collect();
    order.sort_by_key(|one| Reverse(pointer::tokens(&one.former).count()));
    for one in order {
        let property = find(&root, &one.former)?;
        let (former_parent, _) = one.former.rsplit_once('/')?;
        let (present_parent, _) = one.present.rsplit_once('/')?;
        let key = pointer::last_token(&one.present);
        let value = property.value()?;
        let number = in_present_unit(&value, &one.former, &one.present);
        if places.find(present_parent) == former_parent {
            if let Some(number) = number {
                value.as_number_lit()?.set_raw_value(number);
            }
            rename_key(&property, &key)?;
        } else {
            let text = number.unwrap_or_else(|| value.to_string());
            move_property(&root, property, present_parent, &key, text)?;
        }
    }
    Some(root.to_string())
}

/// Returns a number in the unit of its present name, where that is another.
fn in_present_unit(value: &CstNode, former: &str, present: &str) -> Option<String> {
    let written: Value = serde_json::from_str(&value.as_number_lit()?.to_string()).ok()?;
    let number = converted(&written, former, present);
    (number != written).then(|| number.to_string())
}

fn rename_key(property: &CstObjectProp, key: &str) -> Option<()> {
    match property.name()? {
        ObjectPropName::String(name) => name.set_raw_value(Value::from(key).to_string()),
        ObjectPropName::Word(name) => name.set_raw_value(key.to_owned()),
    }
    Some(())
}

/// Moves a property with its text to another object, which is made where it is missing. An
/// object that is empty then is removed.
fn move_property(
    root: &CstRootNode,
    property: CstObjectProp,
    parent: &str,
    key: &str,
    text: String,
) -> Option<()> {
    let around = property.parent()?.as_object()?;
    let holder = around.parent().and_then(|node| node.as_object_prop());
    let target = object_at(root, parent, holder.as_ref())?;
    property.remove();
    // Behind the object that it was in, where that is in the same one.
    let behind = holder.as_ref().and_then(|holder| index_in(&target, holder));
    let index = behind.map_or_else(|| target.properties().len(), |index| index + 1);
    // A number is written as it is, so any text is.
    target.insert(index, key, CstInputValue::Number(text));
    if around.properties().is_empty()
        && let Some(holder) = holder
    {
        holder.remove();
    }
    Some(())
}

fn index_in(object: &CstObject, property: &CstObjectProp) -> Option<usize> {
    let name = property.decoded_name();
    object.properties().iter().position(|one| one.decoded_name() == name)
}

/// Returns the object at a pointer; missing ones are made, the first before `holder`.
fn object_at(
    root: &CstRootNode,
    pointer: &str,
    holder: Option<&CstObjectProp>,
) -> Option<CstObject> {
    let mut object = root.object_value()?;
    for token in pointer::tokens(pointer) {
        object = match object.get(&token) {
            Some(property) => property.object_value()?,
            None => {
                let before = holder.and_then(|holder| index_in(&object, holder));
                let index = before.unwrap_or_else(|| object.properties().len());
                object.insert(index, &token, CstInputValue::Object(Vec::new())).object_value()?
            }
        };
    }
    Some(object)
}

fn find(root: &CstRootNode, pointer: &str) -> Option<CstObjectProp> {
    let (parent, _) = pointer.rsplit_once('/')?;
    let mut node = root.value()?;
    for token in pointer::tokens(parent) {
        node = match node.as_array() {
            Some(array) => array.elements().get(token.parse::<usize>().ok()?)?.clone(),
            None => node.as_object()?.get(&token)?.value()?,
        };
    }
    node.as_object()?.get(&pointer::last_token(pointer))
}

#[cfg(test)]
#[path = "upgrade_tests.rs"]
mod tests;
